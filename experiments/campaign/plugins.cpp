#include "experiments/campaign/plugins.hpp"

#include "experiments/base/embedded.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"

#include <utility>

namespace solenoid {
namespace {

class ProgramRegistry final : public Registry {
 public:
  void add(System& system, const SimulatedSystem& simulation) override {
    register_system(system);
    register_simulation(simulation);
  }
  void add_campaign(const std::string& name, std::string toml) override {
    embed_text("scenarios/" + name + ".toml", std::move(toml));
    shipped_variants();  // or the plug-in is refused, and no campaign after it
  }
};

}  // namespace

Registry& program_registry() {
  static ProgramRegistry registry;
  return registry;
}

void load_plugin(const std::string& path) { load_plugin(path, program_registry()); }

}  // namespace solenoid
