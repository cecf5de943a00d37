#include "experiments/campaign/worst_traces.hpp"

#include "controllers/systems.hpp"

#include <limits>

namespace solenoid {

void WorstTraces::take(std::string_view encoded, std::string_view trace) {
  if (most_ == 0 || trace.empty()) return;
  const RunRecord record = decode_run(encoded, session_).record;
  const double error = record.metrics ? record.metrics->number(campaign_.system->description().judged.metric)
                                      : std::numeric_limits<double>::infinity();
  std::set<Kept>& worst = kept_[record.variant];
  if (worst.size() == most_ && !(error > worst.rbegin()->error)) return;
  worst.insert({error, std::string(encoded), std::string(trace)});
  if (worst.size() > most_) worst.erase(std::prev(worst.end()));
}

void WorstTraces::hand_on(const std::function<void(std::string_view encoded, std::string_view trace)>& to) {
  for (const auto& [variant, worst] : kept_)
    for (const Kept& run : worst) to(run.encoded, run.trace);
  kept_.clear();
}

}  // namespace solenoid
