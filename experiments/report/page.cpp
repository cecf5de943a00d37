#include "experiments/report/page.hpp"

#include "core/config/reader.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/report/report_data.hpp"

#include <fmt/format.h>

namespace solenoid {
namespace {

using Json = nlohmann::ordered_json;

/// In the order in which they use each other.
constexpr const char* scripts[] = {"text",   "trace", "chart",      "thesis", "tables", "distribution",
                                   "paired", "plots", "solve_time", "live",   "main"};

std::string_view asset(const std::string& name) {
  const std::string_view text = embedded_text("report/assets/" + name);
  if (text.empty()) throw std::logic_error("no asset " + name);
  return text;
}

std::string_view uplot(const std::string& name) {
  const std::string_view text = embedded_text("uplot/" + name);
  if (text.empty())
    throw ConfigError(
        "uPlot, which draws a report's curves, was not there when the program was built (install it with: apt-get "
        "install npm, then npm ci in the project's folder, and build again; ./solenoid report does all three)");
  return text;
}

/// JSON that may stand in a script element: '<' occurs in strings only, and there it may be written so.
std::string script_safe(const Json& json) {
  const std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  }
  return safe;
}

void append_element(std::string& page, const char* kind, std::size_t index, const std::string& text) {
  page += fmt::format("<script type=\"text/plain\" id=\"{}-{}\">", kind, index);
  page += text;
  page += "</script>\n";
}

/// The template with each marker replaced by what stands for it.
class Template {
 public:
  explicit Template(std::string_view text) : rest_(text) {}
  /// Appends what is before the marker to `page`, and skips it.
  void copy_to(std::string_view marker, std::string& page) {
    const std::size_t at = rest_.find(marker);
    if (at == std::string_view::npos) throw std::logic_error("page.html lacks " + std::string(marker));
    page += rest_.substr(0, at);
    rest_.remove_prefix(at + marker.size());
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

}  // namespace

std::string base64(std::string_view bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(4 * ((bytes.size() + 2) / 3));
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return i + k < bytes.size() ? std::uint32_t{static_cast<unsigned char>(bytes[i + k])} : 0u;
    };
    const std::uint32_t group = byte(0) << 16 | byte(1) << 8 | byte(2);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[group >> (18 - 6 * k) & 63];
  }
  return text;
}

void require_uplot() { uplot("uPlot.iife.min.js"); }

std::string report_page(const Json& data, const std::vector<EmbeddedTrace>& traces) {
  std::string page;
  Template text(asset("page.html"));
  text.copy_to("<!-- style -->", page);
  page += fmt::format("<style>\n{}{}</style>", uplot("uPlot.min.css"), asset("report.css"));
  text.copy_to("<!-- data -->", page);
  page += fmt::format("<script type=\"application/json\" id=\"data\">{}</script>", script_safe(data));
  text.copy_to("<!-- script -->", page);
  page += fmt::format("<script>{}</script>\n<script>\n\"use strict\";\n(() => {{\n", uplot("uPlot.iife.min.js"));
  for (const char* script : scripts) page += asset(std::string(script) + ".js");
  page += "})();\n</script>\n";
  text.copy_to("<!-- traces -->", page);
  for (std::size_t i = 0; i < traces.size(); ++i)
    if (!traces[i].overview.empty()) append_element(page, "overview", i, traces[i].overview);
  for (std::size_t i = 0; i < traces.size(); ++i)
    if (!traces[i].full.empty()) append_element(page, "full", i, traces[i].full);
  page += text.rest();
  return page;
}

std::string report_of(Results& results, bool full) {
  require_uplot();  // before what takes time
  std::map<std::string, std::string> curves;
  std::vector<EmbeddedTrace> traces;
  std::vector<StoredRun> shown;
  for (StoredRun& run : results.runs) {
    EmbeddedTrace embedded{run.id, {}, {}};
    try {
      if (const auto trace = read_trace(results, run); trace && !trace->ticks.empty()) {
        const bool reduced = !full || trace->ticks.size() > most_without_overview;
        if (reduced) embedded.overview = base64(encode_trace(overview(*trace, overview_spans)));
        if (full) embedded.full = base64(encode_trace(*trace));
        curves[run.id] = !full ? "overview" : reduced ? "both" : "full";
        if (run.solves.counts.empty()) run.solves = trace->solves;
      }
    } catch (const ConfigError& error) {
      const bool counted = results.sampled();  // in the table of all runs: it is only without curves
      results.left_out.push_back({run.id, error.what(), counted});
      if (!counted) continue;
    }
    traces.push_back(std::move(embedded));
    shown.push_back(std::move(run));
  }
  results.runs = std::move(shown);
  return report_page(report_json(results, curves, false), traces);
}

std::string report_of_folder(const std::string& folder, bool full) {
  Results results = read_results(folder);
  return report_of(results, full);
}

}  // namespace solenoid
