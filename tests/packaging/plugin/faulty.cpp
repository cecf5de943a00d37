// Plug-ins as nobody wants them.
#include <csignal>
#include <cstdlib>
#include <stdexcept>

#include <solenoid/controllers/factory.hpp>
#include <solenoid/experiments/plugin/plugin.hpp>
#include <unistd.h>

namespace faulty {

void nobody_has_this(int number);

/// What happens in its hundredth step, or before its first.
enum class Fault { none, abort, hang, leave, refuse };

class Law {
 public:
  explicit Law(const solenoid::VariantConfig& variant) : fault_(static_cast<Fault>(variant.added.at("faulty.kind"))) {
    if (fault_ == Fault::refuse) throw std::runtime_error("this law refuses");
  }

  void believe(const solenoid::EstimateDetail&) noexcept {}
  void decide(const solenoid::Moment&, solenoid::Decision& d) noexcept {
    d.command.switches = 0;
    if (++steps_ < 100) return;
    if (fault_ == Fault::abort) std::abort();
    if (fault_ == Fault::leave) ::_exit(3);
    while (fault_ == Fault::hang) ::pause();
  }
  void look_ahead(const solenoid::Moment&, const solenoid::Decision&, solenoid::SwitchPattern) noexcept {}
  void restart(std::int64_t) noexcept {}

 private:
  Fault fault_;
  int steps_ = 0;
};

}  // namespace faulty

SOLENOID_PLUGIN(FAULT_NAME, registry) {
#if defined FAULT_MISSING
  faulty::nobody_has_this(1);
#elif defined FAULT_REFUSES
  throw std::runtime_error("not on a Sunday");
#elif defined FAULT_CRASHES
  std::raise(SIGSEGV);
#elif defined FAULT_HANGS
  for (;;) ::pause();
#elif defined FAULT_CAMPAIGN
  registry.add_campaign("faulty_campaign", "variants = [");
#endif
  registry.system("thrusters")
      .add(solenoid::LawRow{.name = "faulty",
                            .summary = "does what no law should",
                            .modes = {"pairs"},
                            .make =
                                [](const solenoid::VariantConfig& variant, const solenoid::Motion& reference) {
                                  return solenoid::make_shell(variant, reference, faulty::Law(variant));
                                }},
           {{"faulty.kind", 0.0, {0.0, 4.0}, "", "which fault"}});
}
