// What a campaign of a million members costs before it runs: reading it, a scenario, a run's name and hash, and finding
// a run by its names. Also the samplers' points. Medians of rounds; memory is what reading adds to the process.

#include "core/config/document.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/sampling.hpp"
#include "tests/bench/timing.hpp"
#include "tests/experiments/synthetic_runs.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <unistd.h>

namespace {

using namespace solenoid;
using bench::seconds_of;

double median_of(int rounds, const std::function<double()>& measure) {
  std::vector<double> values(static_cast<std::size_t>(rounds));
  std::ranges::generate(values, measure);
  std::ranges::nth_element(values, values.begin() + rounds / 2);
  return values[static_cast<std::size_t>(rounds / 2)];
}

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  long pages = 0, resident = 0;
  file >> pages >> resident;
  return 1e-6 * static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE));
}

Campaign read(const std::string& text) { return read_campaign(Document::from_text(text, "bench.toml")); }

void measure(const char* sampling, int members) {
  const std::string text =
      test::synthetic_text({"thesis_pd", "nine_robust"}, static_cast<std::size_t>(members), sampling);
  const double before_mb = resident_mb();
  const Campaign campaign = read(text);
  const double kept_mb = resident_mb() - before_mb;
  const double reading_s = median_of(3, [&] { return seconds_of([&] { read(text); }); });
  constexpr std::size_t calls = 2000;
  std::size_t used = 0;
  const auto each_us = [&](std::size_t size, const std::function<std::size_t(std::size_t)>& call) {
    const std::size_t stride = std::max<std::size_t>(1, size / calls);
    return 1e6 / calls * median_of(5, [&] {
             return seconds_of([&] {
               for (std::size_t i = 0; i < calls; ++i) used += call(i * stride % size);
             });
           });
  };
  const RunList& runs = campaign.runs;
  const double scenario_us =
      each_us(campaign.scenarios.size(), [&](std::size_t i) { return campaign.scenarios[i].name.size(); });
  const double run_us = each_us(runs.size(), [&](std::size_t i) { return runs[i].hash.size(); });
  const double find_us = each_us(runs.size(), [&](std::size_t i) {
    return *runs.find(campaign.scenarios.name(i / 2), i % 2 ? "nine_robust" : "thesis_pd", 1);
  });
  fmt::print(
      "{:16} {:9} members {:9} runs: read {:.3f} s, {:.1f} MB, resolved {} bytes; scenario {:.1f} us, run {:.2f} "
      "us, find {:.2f} us{}\n",
      sampling, members, runs.size(), reading_s, kept_mb, campaign.resolved_toml.size(), scenario_us, run_us, find_us,
      used == 0 ? "." : "");
}

void measure_points(Sampling method, const char* name, std::size_t points) {
  const Sampler sampler(method, 1, 7, points);
  double sum = 0.0;
  const double us = median_of(5, [&] {
    return seconds_of([&] {
      for (std::size_t k = 0; k < points; k += points / 900) sum += sampler.at(k).front();
    });
  });
  fmt::print("{:16} a point of {} in 7 dimensions: {:.2f} us (mean {:.3f})\n", name, points, 1e6 * us / 900,
             sum / 4500);
}

}  // namespace

int main() {
  read(test::synthetic_text({"thesis_pd"}, 1));  // what is read once: shipped files, the program's own fingerprint
  measure("sobol", 1'000'000);
  measure("latin_hypercube", 1'000'000);
  measure("shuffled", 999);
  measure_points(Sampling::sobol, "sobol", 10'000'000);
  measure_points(Sampling::latin_hypercube, "latin_hypercube", 10'000'000);
  measure_points(Sampling::shuffled, "shuffled", 999);
}
