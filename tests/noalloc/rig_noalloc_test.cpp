#include "controllers/factory.hpp"
#include "controllers/systems/actuator/actuator_guard.hpp"
#include "core/config/document.hpp"
#include "core/rt/allocation_guard.hpp"
#include "core/rt/clock.hpp"
#include "core/rt/control_loop.hpp"
#include "core/rt/ring.hpp"
#include "core/systems/actuator/signals.hpp"
#include "experiments/base/embedded.hpp"
#include "experiments/campaign/campaign.hpp"
#include "experiments/campaign/simulated_system.hpp"
#include "experiments/rig/background.hpp"
#include "experiments/rig/faulty_plant.hpp"
#include "experiments/rig/node_protocol.hpp"
#include "experiments/systems/actuator/simulation/actuator_scenario.hpp"

#include <gtest/gtest.h>

namespace solenoid {
namespace {

struct RingRecorder {
  void record(const TickRecord& tick) noexcept {
    seen[static_cast<std::size_t>(tick.decision.rung)] = true;
    ring.push(tick);
  }
  Ring<TickRecord> ring{64};  // it fills up, and refuses
  std::array<bool, solenoid::rungs> seen{};
};

/// Every rung, skipped ticks and a re-arm: nothing of it allocates.
TEST(HotPath, TheLadderAllocatesNothingOnAnyRung) {
  const Campaign campaign = read_campaign("rig", {{"nine_state"}, {"cycloidal"}});
  const ScenarioConfig& scenario = campaign.scenarios.front();
  const VariantConfig& variant = campaign.variants.front();
  LadderSettings settings = actuator_ladder();
  settings.held_slots = settings.backup_slots = 4;
  // Plans that are not numbers from 0.1 s to 0.4 s: shifted, dmpc, motor, safe.
  const auto ladder = make_ladder(variant, scenario.trajectory, settings,
                                  in_background({}, parse_faults({"solver:nan@0.1+0.3"}, actuator_simulation())));
  FaultyPlant plant(make_plant(variant, scenario, 1), {}, variant, 1);
  CommandLimits limits = make_limits(variant);
  RingRecorder recorder;
  MonotonicClock clock;
  ControlLoop loop(plant, clock, *ladder, limits, recorder);
  const std::int64_t before = AllocationGuard::thread_allocations();
  loop.run(500, actuator_timing.tick_s);
  ladder->request_rearm();
  loop.run(100, actuator_timing.tick_s);
  EXPECT_EQ(AllocationGuard::thread_allocations() - before, 0);
  EXPECT_TRUE(recorder.seen[static_cast<std::size_t>(Rung::fresh)]);
  EXPECT_TRUE(recorder.seen[static_cast<std::size_t>(Rung::safe)]);
}

/// The tick in which a coil is found to have failed, and what is left takes the bank's place everywhere, allocates nothing.
TEST(HotPath, DoingWithoutACoilAllocatesNothing) {
  /// Notes the set of modes that is commanded from.
  struct Sets {
    void record(const TickRecord& tick) noexcept { last = tick.decision.mode_set; }
    int last = 0;
  };
  const Campaign campaign = read_campaign(
      Document::from_text(std::string(embedded_text("tasks/valve_health.toml")), "tasks/valve_health.toml"));
  const ScenarioConfig scenario = campaign.scenarios.at(205);
  const VariantConfig variant = told(campaign.variants.front(), scenario);
  const auto ladder = make_ladder(variant, scenario.trajectory, actuator_ladder());
  FaultyPlant plant(make_plant(variant, scenario, 1),
                    parse_faults({"coil_exhaust_a:stuck_open@0.5"}, actuator_simulation()), variant, 1);
  CommandLimits limits = make_limits(variant);
  Sets recorder;
  FakeClock clock;
  ControlLoop loop(plant, clock, *ladder, limits, recorder);
  const std::int64_t before = AllocationGuard::thread_allocations();
  loop.run(2000, actuator_timing.tick_s);
  EXPECT_EQ(AllocationGuard::thread_allocations() - before, 0);
  EXPECT_GT(recorder.last, 0);
}

TEST(HotPath, PacketsAreMadeAndReadWithoutAllocation) {
  const NodeKey key{};
  const std::int64_t before = AllocationGuard::thread_allocations();
  NodePacket packet(NodePacket::Type::command);
  NodeCommand{5, {1'000'000}}.put(packet, 1);
  std::array<char, NodePacket::most_size> bytes;
  const std::size_t size = packet.encode(bytes, &key);
  const auto again = NodePacket::decode({bytes.data(), size}, &key);
  const auto command = again ? NodeCommand::of(*again, 1) : std::nullopt;
  EXPECT_EQ(AllocationGuard::thread_allocations() - before, 0);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->switches, 5u);
}

}  // namespace
}  // namespace solenoid
