#pragma once

#include "experiments/report/results.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace solenoid {

/// Spans of a run's overview: what a page draws before it is zoomed.
inline constexpr int overview_spans = 450;
/// Ticks up to which a run is decoded so fast that it needs none.
inline constexpr std::size_t most_without_overview = 20'000;

/// The page's curves of one run, as text: base64 of encode_trace.
struct EmbeddedTrace {
  std::string id, overview, full;
};

/// One HTML file: markup, style, scripts, data and curves; it asks the network for nothing. Text of the data cannot end
/// or begin markup. Throws as require_uplot does.
std::string report_page(const nlohmann::ordered_json& data, const std::vector<EmbeddedTrace>& traces);

/// Results as such a page. `full`: with every tick of every run, else with overviews only. Runs whose curves cannot be
/// read are left out, and said so in `results`.
std::string report_of(Results& results, bool full);
/// The same of a folder.
std::string report_of_folder(const std::string& folder, bool full);

/// Throws ConfigError saying how to get it if the program was built without uPlot.
void require_uplot();

std::string base64(std::string_view bytes);

}  // namespace solenoid
