#include "experiments/campaign/written_runs.hpp"

#include <string>
#include <utility>

#include <nlohmann/json.hpp>

namespace solenoid {
namespace {

/// Hands text on in large pieces.
class Pieces {
 public:
  explicit Pieces(const TextSink& write) : write_(write) {}

  std::string& text() { return text_; }
  void hand_on(std::size_t from) {
    if (text_.size() < from) return;
    write_(text_);
    text_.clear();
  }

 private:
  const TextSink& write_;
  std::string text_;
};

constexpr std::size_t at_once = 1 << 16;

/// A run's object as it stands in the list.
void append_indented(const nlohmann::ordered_json& run, std::string& text) {
  const std::string lines = run.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  text += "\n  ";
  for (const char c : lines) {
    text += c;
    if (c == '\n') text += "  ";
  }
}

}  // namespace

void write_csv(const StoredRuns& runs, const SystemDescription& system, const TextSink& write) {
  Pieces csv(write);
  csv.text() = csv_heading(system);
  for_each_run(runs, [&](std::size_t, const KeptRun& run) {
    append_csv_line(run.record, system, csv.text());
    csv.hand_on(at_once);
  });
  csv.hand_on(1);
}

void write_json(const StoredRuns& runs, const nlohmann::ordered_json& more, const TextSink& write) {
  Pieces json(write);
  json.text() = "{\n \"runs\": [";
  const char* before = "";
  for_each_run(runs, [&](std::size_t, const KeptRun& run) {
    json.text() += std::exchange(before, ",");
    append_indented(to_json(run.record), json.text());
    json.hand_on(at_once);
  });
  json.text() += *before ? "\n ]" : "]";
  if (more.empty())
    json.text() += "\n}\n";
  else
    json.text() += ',' + more.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).substr(1) + '\n';
  json.hand_on(1);
}

}  // namespace solenoid
