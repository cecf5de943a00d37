#include "experiments/report/comparison.hpp"

#include "controllers/catalogue.hpp"
#include "experiments/campaign/run_campaign.hpp"
#include "experiments/python/interruptible.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace solenoid {
namespace {

/// What compare() found.
struct Compared {
  Result result;
  std::string folder;

  std::string html() const {
    std::string all;
    for (const Table& table : result.tables) all += table.html();
    for (const std::string& note : result.notes) all += "<p>" + html_escaped(note) + "</p>\n";
    return all;
  }
};

Compared compare(const std::string& toml, const CampaignOptions& options, const std::string& baseline, bool details) {
  const Campaign campaign = read_campaign(Document::from_text(toml, "solenoid.compare"));
  require_baseline(names_of(campaign.variants), baseline, "baseline");
  std::optional<std::vector<RunRecord>> records;
  Compared found;
  {
    const py::gil_scoped_release free;
    if (options.out.empty()) {
      records = run_in_processes(campaign, options.jobs, options.tick_limit_s);
    } else if (CampaignResult result = run_campaign(campaign, options); !result.interrupted) {
      records = result.records();
      found.folder = result.folder;
    }
  }
  if (!records) raise_keyboard_interrupt();
  found.result = result_of(*records, details, baseline);
  if (std::string note = real_time_note(campaign.variants); !note.empty())
    found.result.notes.push_back(std::move(note));
  if (!found.folder.empty()) found.result.notes.push_back("Results: " + found.folder);
  return found;
}

}  // namespace

void bind_comparison(py::module_& m) {
  py::class_<Compared>(m, "Compared")
      .def_readonly("folder", &Compared::folder)
      .def("json", [](const Compared& c) { return c.result.json(); })
      .def("text", [](const Compared& c) { return c.result.text(false); })
      .def("html", &Compared::html);
  m.def(
      "compare",
      [](const std::string& toml, const std::string& out, int jobs, double tick_limit_s, const std::string& baseline,
         bool details) {
        return compare(toml, {.out = out, .jobs = jobs, .tick_limit_s = tick_limit_s, .progress = false}, baseline,
                       details);
      },
      py::arg("toml"), py::arg("out"), py::arg("jobs"), py::arg("tick_limit_s"), py::arg("baseline"),
      py::arg("details"));
}

}  // namespace solenoid
