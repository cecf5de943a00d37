#include <cmath>
#include <memory>

#include <solenoid/controllers/factory.hpp>
#include <solenoid/experiments/plugin/plugin.hpp>

namespace plugin_name {

/// Fires against the greatest of x, y and angle in the (error, rate) plane, each beyond a switching line with a dead zone:
///
///     s = e + time * de/dt;    nothing if |s| < dead zone
///
/// A Decider (controllers/controller_shell.hpp): estimator, references, limits and logs are what every controller has.
class SwitchingLines {
 public:
  explicit SwitchingLines(const solenoid::VariantConfig& variant)
      : time_s_(variant.added.at("plugin_name.time_s")),
        dead_m_(variant.added.at("plugin_name.dead_zone_m")),
        modes_(solenoid::system_of(variant).modes(variant)) {}

  void believe(const solenoid::EstimateDetail&) noexcept {}

  void decide(const solenoid::Moment&, solenoid::Decision& d) noexcept {
    static constexpr const char* pairs[3][2] = {{"+x", "-x"}, {"+y", "-y"}, {"+turn", "-turn"}};
    std::size_t worst = 0;
    std::array<double, 3> s{};
    for (std::size_t a = 0; a < 3; ++a) {
      const solenoid::MotionSample& desired = d.reference.axis[a];
      s[a] = (desired.value - d.estimate[a]) + time_s_ * (desired.rate - d.estimate[a + 3]);
      if (std::abs(s[a]) > std::abs(s[worst])) worst = a;
    }
    d.command.switches = modes_.safe_pattern();
    if (std::abs(s[worst]) < dead_m_) return;
    for (const solenoid::Mode& mode : modes_.modes())
      if (mode.name == pairs[worst][s[worst] < 0 ? 1 : 0]) d.command.switches = mode.pattern;
  }

  void look_ahead(const solenoid::Moment&, const solenoid::Decision&, solenoid::SwitchPattern) noexcept {}
  void restart(std::int64_t) noexcept {}

 private:
  double time_s_, dead_m_;
  solenoid::ModeSet modes_;
};

}  // namespace plugin_name

SOLENOID_PLUGIN("plugin_name", registry) {
  registry.system("thrusters")
      .add(solenoid::LawRow{.name = "plugin_name",
                            .summary = "switching lines with a dead zone",
                            .modes = {"pairs", "combined"},
                            .make =
                                [](const solenoid::VariantConfig& variant, const solenoid::Motion& reference) {
                                  return solenoid::make_shell(variant, reference, plugin_name::SwitchingLines(variant));
                                }},
           {{"plugin_name.time_s", 3.0, {0.0, 100.0}, "s", "weight of the rate"},
            {"plugin_name.dead_zone_m", 0.02, solenoid::Range::positive(), "m", "or rad, in which nothing fires"}});
}
