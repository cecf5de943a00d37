#include "experiments/systems/actuator/commission/commission.hpp"

#include "controllers/systems/actuator/actuator_variant.hpp"
#include "core/config/reader.hpp"
#include "experiments/systems/actuator/commission/steps.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace solenoid {
namespace {

struct Step {
  StepInfo info;
  void (*carry_out)(CommissionState&, StepOutcome&);
};

const std::vector<Step>& steps() {
  static const std::vector<Step> all = {
      {{"link", "reads for 0.2 s, outputs safe", "99 of 100 reads within a tick, at most 2 % missed"}, link_step},
      {{"sensors", "each sensor at rest for 0.5 s, outputs safe, chambers vented",
        "inside its converter; noise up to 0.2 mm and 1.5 kPa; pressures within 12 kPa of the atmosphere's"},
       sensors_step},
      {{"position", "the slide by hand to both end stops",
        "rises from the low stop to the high one; stops within 1.5 mm"},
       position_step},
      {{"motor", "a force towards +y that rises from 1 N to 7 N until the slide moves by 1 mm",
        "the position rises; it moves below 6 N"},
       motor_step},
      {{"coils", "each coil alone for 10 to 80 ms, from the least pressure on",
        "its own chamber answers, the other does not, the slide follows: every wire is where it should be"},
       coils_step},
      {{"leak", "both chambers at about 30 kPa, shut, for 2 s", "loses at most 3 % a second of its gauge pressure"},
       leak_step},
      {{"supply", "both chambers filled, the motor holding the slide",
        "both settle within 10 kPa of the supply's gauge pressure"},
       supply_step},
      {{"delays", "a short and a longer pulse of each coil that fills, against the same on the twin",
        "opens and closes within 2.5 ms of the model's delays"},
       delays_step},
      {{"end_stops", "the motor creeps to both stops at 40 mm/s with at most 5 N, chambers vented (horizontal plane)",
        "within 1.5 mm of where the stops are, or beyond the converter's end; outside the rig's limits"},
       end_stops_step},
      {{"identify", "the actuator's parameters", "the command to run is told"}, identify_step},
      {{"motion", "a slow cycloid under the fallback ladder", "ends clean; RMSE up to 5 mm"}, motion_step}};
  return all;
}

void judge(StepOutcome& out) {
  for (const Measured& m : out.measured)
    if (!m.good()) out.verdict = StepVerdict::failed;
  if (!out.findings.empty()) out.verdict = StepVerdict::failed;
}

}  // namespace

const char* to_string(StepVerdict verdict) {
  switch (verdict) {
    case StepVerdict::passed:
      return "passed";
    case StepVerdict::failed:
      return "failed";
    case StepVerdict::skipped:
      return "skipped";
    case StepVerdict::stopped:
      break;
  }
  return "stopped";
}

const Measured* StepOutcome::find(const std::string& of) const {
  const auto at = std::ranges::find(measured, of, &Measured::name);
  return at == measured.end() ? nullptr : &*at;
}

const std::vector<StepInfo>& commission_steps() {
  static const std::vector<StepInfo> infos = [] {
    std::vector<StepInfo> all;
    for (const Step& s : steps()) all.push_back(s.info);
    return all;
  }();
  return infos;
}

CommissionState new_commission(Bench& bench, const CommissionSettings& settings) {
  const VariantConfig& variant = *settings.variant;
  const bool three_way = variant.modes == "three_way";
  if (!three_way && variant.modes != "two_way")
    throw ConfigError(fmt::format("commission: variant '{}' is on '{}' valves (allowed: two_way, three_way)",
                                  variant.name, variant.modes));
  CommissionState state{bench, settings, actuator(variant).nominal, three_way, {}, {}, false};
  state.nominal.plane = settings.plane;
  state.seen.three_way = three_way;
  return state;
}

void recall(CommissionState& state, const std::vector<StepOutcome>& earlier) {
  state.wiring_is_known = false;
  const auto answer = [&](const char* step, const char* name) -> Answer {
    for (const StepOutcome& o : earlier)
      if (o.name == step)
        if (const Measured* m = o.find(name)) return static_cast<int>(std::lround(m->value));
    return std::nullopt;
  };
  state.seen.by_hand = answer("position", "direction");
  state.seen.motor = state.loop = answer("motor", "direction");
  state.seen.at_rest = {answer("sensors", "pressure_a_at_rest"), answer("sensors", "pressure_b_at_rest")};
  for (const StepOutcome& o : earlier)
    if (o.name == "coils") state.wiring_is_known = o.verdict == StepVerdict::passed;
}

bool went_wrong(const StepOutcome& step) {
  return step.verdict == StepVerdict::failed || step.verdict == StepVerdict::stopped;
}

/// Whether nothing may move after it: a link that is none, or a position that cannot be read. (Pressures that are not as
/// they should be at rest tell the coils' step what is wired how.)
bool blinds(const StepOutcome& step) {
  if (step.name == "link" || step.verdict == StepVerdict::stopped) return went_wrong(step);
  return step.name == "sensors" && std::ranges::any_of(step.measured, [](const Measured& m) {
           return m.name.starts_with("position") && !m.good();
         });
}

/// The step, before this one, that keeps it from moving anything; the first motion is kept by whatever has gone wrong.
std::string held_back_by(const std::string& name, const std::vector<StepOutcome>& earlier) {
  if (name == "link" || name == "sensors" || name == "position" || name == "identify") return "";
  for (const StepInfo& step : commission_steps()) {
    if (step.name == name) return "";
    const auto at = std::ranges::find(earlier, step.name, &StepOutcome::name);
    if (at != earlier.end() && (name == "motion" ? went_wrong(*at) : blinds(*at))) return step.name;
  }
  return "";
}

StepOutcome carry_out(const std::string& name, CommissionState& state, const std::vector<StepOutcome>& earlier) {
  const auto step = std::ranges::find(steps(), name, [](const Step& s) { return std::string(s.info.name); });
  if (step == steps().end()) throw std::invalid_argument("no step is called '" + name + "'");
  recall(state, earlier);
  StepOutcome out;
  out.name = name;
  out.at = state.settings.now();
  if (const std::string before = held_back_by(name, earlier); !before.empty()) {
    out.verdict = StepVerdict::skipped;
    out.note = "step " + before + " has not passed";
    return out;
  }
  const double began_s = state.bench.now_s();
  const auto end = [&] {
    state.bench.safe();
    out.seconds = state.bench.now_s() - began_s;
  };
  try {
    step->carry_out(state, out);
    if (out.verdict == StepVerdict::passed) judge(out);
  } catch (const BenchInterrupted&) {
    end();
    throw;
  } catch (const BenchStopped& stopped) {
    out.verdict = StepVerdict::stopped;
    out.note = stopped.what();
  } catch (...) {
    end();
    throw;
  }
  end();
  return out;
}

}  // namespace solenoid
