// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <sstream>
#include <vector>

#include "protocol/wire/codec.h"
#include "server/recording/flight_file.h"
#include "server/recording/recording_reader.h"
#include "tests/tools/worlds/adversary.h"
#include "tests/tools/worlds/pressed_wall.h"
#include "tests/tools/worlds/watched_device.h"

namespace tendon::simulation::world_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
// In contact from 0.5 s on.
SimulatedDevice::Config pressing_hand() { return moved_falcon(Vec3(0.015, 0, 0), milliseconds(800), std::nullopt); }

TEST(World, AHandFeelsARemoteLateSlowWallAndItStaysStable) {
  SimulatedDevice device(pressing_hand());
  World world(world_config(device.info()), device);
  world.add_controller(at_100_hz(), wall());
  Log log(world);
  world.run_for(seconds(5));
  EXPECT_GE(log.least_energy(), -1e-9);
  EXPECT_GT(log.peak(), 1);
  const StepRecord& last = log.steps.back();
  EXPECT_EQ(last.mode, Mode::kActive);
  EXPECT_LT(last.hand.velocity.norm(), 0.005);
  EXPECT_GE(last.loop_age, milliseconds(30));  // the force's age is 30 … 70 ms
  EXPECT_LE(last.loop_age, milliseconds(90));
}

TEST(World, WithoutTheLimiterTheSameWallMakesThePortActive) {
  SimulatedDevice device(pressing_hand());
  World::Config config = world_config(device.info());
  config.loop.control.limiter.law = Law::kNone;
  World world(config, device);
  world.add_controller(at_100_hz(), wall());
  Log log(world);
  world.run_for(seconds(5));
  EXPECT_LT(log.least_energy(), -0.1);
}

TEST(World, SameSeedSameBytes) {
  const auto recording = [](std::uint64_t seed) {
    SimulatedDevice device(pressing_hand());
    World::Config config = world_config(device.info(), seed);
    config.record = true;
    config.latest_wake = milliseconds(1);
    config.scene_text = "kind = 'world'";
    World world(config, device);
    world.add_controller(at_100_hz(), wall());
    world.add_observer({.name = "Y"}, [](const DeviceState&, const LinkStats&) {});
    world.run_for(seconds(2));
    return world.finish_recording();
  };
  const auto first = recording(7);
  EXPECT_GT(first.size(), 500'000U);
  EXPECT_EQ(first, recording(7));
  EXPECT_NE(first, recording(8));
}

RecordingReader reader_of(std::span<const std::byte> bytes) {
  return {std::make_unique<std::istringstream>(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size())),
          "world"};
}

TEST(World, ARecordingHoldsEveryStepAndEveryDatagram) {
  SimulatedDevice device(pressing_hand());
  World::Config config = world_config(device.info());
  config.record = true;
  World world(config, device);
  const std::size_t z = world.add_controller(at_100_hz(), wall());
  Log log(world);
  world.run_for(seconds(1));
  const auto& bytes = world.finish_recording();
  RecordingReader reader = reader_of(bytes);
  std::size_t steps = 0;
  std::size_t datagrams_in = 0;
  while (const auto record = reader.next()) {
    if (const auto* step = std::get_if<StepRecord>(&*record)) {
      ASSERT_LT(steps, log.steps.size());
      EXPECT_EQ(step->tick, log.steps[steps].tick);
      EXPECT_EQ(step->hand.position, log.steps[steps].hand.position);
      EXPECT_EQ(step->applied, log.steps[steps].applied);
      ++steps;
    } else if (const auto* datagram = std::get_if<DatagramRecord>(&*record)) {
      if (datagram->direction == DatagramRecord::Direction::kIn) ++datagrams_in;
    }
  }
  EXPECT_FALSE(reader.truncated());
  EXPECT_EQ(steps, log.steps.size());
  EXPECT_GT(datagrams_in, world.client(z).stats().forces / 2);
}

TEST(World, AKilledEnginesForceHoldsFadesStopsAndComesBackRampedIn) {
  SimulatedDevice device(pressing_hand());
  World world(world_config(device.info()), device);
  const std::size_t z = world.add_controller(at_100_hz(), wall());
  world.run_for(seconds(3));
  Log log(world);
  world.run_for(milliseconds(100));
  ASSERT_GT(log.steps.back().applied.norm(), 0.5);
  world.kill(z);
  world.run_for(seconds(1));
  EXPECT_EQ(log.modes(), (std::vector{Mode::kActive, Mode::kHolding, Mode::kDecaying, Mode::kSafeStop}));
  EXPECT_EQ(log.steps.back().applied.norm(), 0);

  log.steps.clear();
  world.add_controller(at_100_hz(), wall());
  world.run_for(seconds(6));
  EXPECT_EQ(log.steps.back().mode, Mode::kActive);
  EXPECT_GT(log.steps.back().applied.norm(), 0.5);
  // The slew limit is 1000 N/s, and the longest hold is 2 ms.
  EXPECT_LE(log.largest_rise(), 1000 * 2e-3 + 1e-9);
  EXPECT_TRUE(log.has(Reason::kRampIn));
}

TEST(World, ADeviceFaultZeroesTheForceSavesStepsAndOnlyRearmLeavesIt) {
  class FailingDevice final : public Device {
   public:
    explicit FailingDevice(const SimulatedDevice::Config& config) : device_(config) {}
    const DeviceInfo& info() const noexcept override { return device_.info(); }
    std::optional<PositionSample> read(LocalTime now) noexcept override {
      auto sample = device_.read(now);
      if (failing) sample->position.x() = std::nan("");
      return sample;
    }
    Vec3 apply(const Vec3& force) noexcept override { return device_.apply(force); }
    bool failing = false;

   private:
    SimulatedDevice device_;
  };
  FailingDevice device(pressing_hand());
  World::Config config = world_config(device.info());
  World world(config, device);
  const std::size_t z = world.add_controller(at_100_hz(), wall());
  world.run_for(seconds(2));
  device.failing = true;
  world.run_for(milliseconds(10));
  device.failing = false;
  Log log(world);
  world.run_for(milliseconds(200));
  EXPECT_EQ(world.haptic().stats().fault, HapticController::Fault::kPositionNotFinite);
  EXPECT_EQ(log.modes(), std::vector{Mode::kFault});
  EXPECT_EQ(log.peak(), 0);

  ASSERT_TRUE(world.mail().flight.frozen());
  MemorySink sink;
  write_flight(world.mail().flight, world.recorder_config(), world.mail().ways, sink);
  RecordingReader reader = reader_of(sink.bytes());
  StepRecord last;
  std::size_t steps = 0;
  while (const auto record = reader.next()) {
    if (const auto* step = std::get_if<StepRecord>(&*record)) {
      last = *step;
      ++steps;
    }
  }
  EXPECT_GT(steps, 1900U);
  EXPECT_TRUE(last.reasons.has(Reason::kNotFinite));

  ASSERT_TRUE(world.client(z).rearm());
  world.run_for(seconds(1));
  EXPECT_EQ(world.haptic().stats().fault, HapticController::Fault::kNone);
  // The mode is idle in between, unless a fresh force arrives with the request. The force is ramped in both cases.
  EXPECT_EQ(log.modes().front(), Mode::kFault);
  EXPECT_EQ(log.modes().back(), Mode::kActive);
  EXPECT_TRUE(log.has(Reason::kRampIn));
  EXPECT_GT(log.steps.back().applied.norm(), 0.5);
}

TEST(World, OneControllerAndSeveralObserversAndNobodyElse) {
  SimulatedDevice device(pressing_hand());
  World::Config config = world_config(device.info());
  config.max_observers = 2;
  World world(config, device);
  const std::size_t z = world.add_controller(at_100_hz(), wall());
  world.run_for(seconds(2));
  ForceClient::Config second = at_100_hz();
  second.name = "Y";
  second.seed = 1;
  const std::size_t y = world.add_controller(second, wall());
  std::vector<std::size_t> observers;
  for (std::uint64_t i = 0; i < 3; ++i) {
    observers.push_back(world.add_observer({.name = "X", .seed = 2 + i}, [](const DeviceState&, const LinkStats&) {}));
    world.run_for(seconds(1));
  }
  world.run_for(seconds(1));
  EXPECT_EQ(world.client(z).phase(), ForceClient::Phase::kOpen);
  EXPECT_EQ(world.client(y).stats().code, Code::kBusy);
  EXPECT_NE(world.client(y).stats().reason.find("controlled by \"Z\""), std::string::npos);
  EXPECT_EQ(world.client(observers[0]).phase(), ForceClient::Phase::kOpen);
  EXPECT_EQ(world.client(observers[1]).phase(), ForceClient::Phase::kOpen);
  EXPECT_EQ(world.client(observers[2]).stats().code, Code::kBusy);
  EXPECT_GT(world.client(observers[0]).stats().states, 1000U);
}

TEST(World, AnObserverCannotRearmNorSendForces) {
  SimulatedDevice device(pressing_hand());
  World world(world_config(device.info()), device);
  const std::size_t y = world.add_observer({.name = "Y"}, [](const DeviceState&, const LinkStats&) {});
  world.run_for(seconds(1));
  ASSERT_TRUE(world.client(y).rearm());
  world.run_for(seconds(1));
  EXPECT_EQ(world.server().stats().denied, 1U);
}

TEST(World, ALocalModelIsUsedWhenBothEndsKnowItAndMakesTheContactStiffer) {
  const auto depth = [](bool with_model) {
    SimulatedDevice device(pressing_hand());
    World world(world_config(device.info()), device);
    world.add_controller(at_100_hz(), [with_model](const DeviceState& hand) -> Touch {
      Touch touch = wall()(hand);
      if (with_model && hand.position.x() > 0) touch.stiffness = Vec3(kWallStiffness, 0, 0).asDiagonal();
      return touch;
    });
    Log log(world);
    world.run_for(seconds(5));
    return log.steps.back().hand.position.x();
  };
  EXPECT_LT(depth(true), depth(false));
}

TEST(World, BadAndReplayedDatagramsAreCountedAndChangeNothing) {
  SimulatedDevice device(pressing_hand());
  World world(world_config(device.info()), device);
  const std::size_t z = world.add_controller(at_100_hz(), wall());
  world.run_for(seconds(2));
  const auto before = world.server().stats();
  Dice dice(3);
  const Address server = world.server_address();
  const Address stranger{world.client_address(z).ip, 9};
  for (int i = 0; i < 200; ++i) {
    std::vector<std::byte> garbage(static_cast<std::size_t>(dice.within(0, 1199)) + 1);
    for (std::byte& b : garbage) b = static_cast<std::byte>(dice.bits());
    world.network().forge(i % 2 == 0 ? stranger : world.client_address(z), server, std::move(garbage));
  }
  world.network().forge(stranger, server, std::vector<std::byte>(60000));
  Log log(world);
  world.run_for(seconds(1));
  const auto after = world.server().stats();
  const auto dropped = [](const NetworkLoop::Stats& stats) { return stats.malformed + stats.unknown_connection; };
  EXPECT_GE(dropped(after) - dropped(before), 201U);
  EXPECT_EQ(after.welcomed, before.welcomed);
  EXPECT_EQ(world.client(z).phase(), ForceClient::Phase::kOpen);
  EXPECT_GT(after.forces, before.forces + 80);
  EXPECT_EQ(log.modes(), std::vector{Mode::kActive});
}

TEST(World, NotANumberOnTheWireIsCountedAndNeverReachesTheDevice) {
  SimulatedDevice device(pressing_hand());
  World world(world_config(device.info()), device);
  const std::size_t z = world.add_controller(at_100_hz(), wall());
  world.run_for(seconds(2));
  // Our clients cannot send such a force; writes it as an attacker who knows the session.
  const std::uint64_t sent = world.client(z).stats().link.datagrams_sent;
  const std::uint64_t invalid = world.server().stats().controller.invalid;
  constexpr double kInf = std::numeric_limits<double>::infinity();
  std::uint64_t number = sent;
  for (const double bad : {std::nan(""), kInf, -kInf, 1e300}) {
    std::array<std::byte, kMaxDatagram> buffer;
    DataWriter writer;
    writer.begin(buffer, {.connection_id = 1, .packet_number = number++}, world.now(), std::nullopt);
    ForceCommand command;
    command.sequence = 1'000'000;
    command.based_on_tick = 2000;
    command.force = Vec3(bad, 0, 0);
    command.valid_for = milliseconds(30);
    writer.add(command);
    world.network().forge(world.client_address(z), world.server_address(),
                          {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(writer.size())});
  }
  Log log(world);
  world.run_for(seconds(1));
  EXPECT_EQ(world.server().stats().controller.invalid, invalid + 4);
  for (const StepRecord& step : log.steps) {
    ASSERT_TRUE(step.applied.allFinite());
    ASSERT_LE(step.applied.norm(), device.info().max_force);
  }
  EXPECT_EQ(log.steps.back().mode, Mode::kActive);
}

TEST(World, TheLawBooksTheForceThatADeviceKeepsWhenItIsToldZero) {
  SimulatedDevice device(pressing_hand());
  World::Config config = world_config(device.info());
  config.loop.control.limiter.law = Law::kAol;
  WatchedDevice port(
      device,
      {.friction = config.loop.control.limiter.friction, .unseen = 0.05, .most_gone = 3, .disobeys = 0.5, .seed = 11});
  World world(config, port);
  world.add_controller(at_100_hz(), wall());
  int kept = 0;
  double worst = 0;
  world.watch_steps([&](const StepRecord& step) {
    if (step.reasons.has(Reason::kUnseen) && step.applied.norm() > 0.5) ++kept;
    worst = std::max(worst, std::abs(step.energy - port.energy()));
  });
  world.run_for(seconds(4));
  EXPECT_GT(kept, 20) << "zero must have been ignored while a force was held";
  EXPECT_LT(worst, 1e-9) << "J, the law's account against the checker's";
}

TEST(World, PausesOfTheMachineAreFlaggedAndTheLedgerRecoversByItself) {
  SimulatedDevice::Config hand = pressing_hand();
  hand.watchdog = milliseconds(5);
  SimulatedDevice device(hand);
  World::Config config = world_config(device.info());
  config.loop.control.watchdog = milliseconds(5);
  config.pause_probability = 5e-3;
  config.pause = milliseconds(30);
  World world(config, device);
  world.add_controller(at_100_hz(), wall());
  Log log(world);
  world.run_for(seconds(10));
  std::uint64_t overruns = 0;
  for (std::size_t i = 1; i < log.steps.size(); ++i) {
    const StepRecord& step = log.steps[i];
    if (step.reasons.has(Reason::kOverrun)) {
      ++overruns;
      continue;
    }
    // The energy is not negative between overruns. If it is below zero, it does not decrease.
    EXPECT_GE(step.energy, std::min(-1e-9, log.steps[i - 1].energy - 1e-15));
    if (step.energy < 0) {
      EXPECT_LE(step.applied.norm(), config.loop.control.limiter.friction.coulomb * (1 + 1e-9));
    }
  }
  EXPECT_GT(overruns, 10U);
  EXPECT_EQ(overruns, world.haptic().stats().overruns);
}

// The link's 700 kbit/s carry 400 states/s.
NetworkLoop::Stats on_a_narrow_link(bool adapt) {
  SimulatedDevice device(pressing_hand());
  World::Config config = world_config(device.info());
  config.weather = {.up = injector::parse_profile("base=5ms"),
                    .down = injector::parse_profile("base=5ms rate=700kbit/s queue=2000packets")};
  config.adapt_state_rate = adapt;
  World world(config, device);
  world.add_controller(at_100_hz(), wall());
  world.run_for(seconds(14));
  return world.server().stats();
}

TEST(World, WhereALinkIsNarrowStatesLeaveMoreRarelyAndSoArriveSooner) {
  EXPECT_GT(on_a_narrow_link(false).controller.smoothed_round_trip, seconds(2));
  EXPECT_LT(on_a_narrow_link(true).controller.smoothed_round_trip, milliseconds(30));
}

TEST(World, OverALinkThatLosesTooMuchForcesAreNotTakenWhereTheRateIsAdapted) {
  SimulatedDevice device(pressing_hand());
  World::Config config = world_config(device.info());
  config.weather = {.up = injector::parse_profile("base=5ms"), .down = injector::parse_profile("base=5ms loss=30%")};
  config.adapt_state_rate = true;
  World world(config, device);
  world.add_controller(at_100_hz(), wall());
  Log log(world);
  world.run_for(seconds(12));
  EXPECT_GT(world.server().stats().unusable, 100U);
  EXPECT_NE(log.steps.back().mode, Mode::kActive);
}

std::string told(World& world) {
  std::string text;
  for (const NetworkLoop::Notice& notice : world.server().take_notices()) text += notice.text + "\n";
  return text;
}

TEST(World, TheOperatorIsToldWhyAForceWasLate) {
  SimulatedDevice device(pressing_hand());
  World::Config config = world_config(device.info());
  config.weather = {.up = injector::parse_profile("base=20ms"),
                    .down = injector::parse_profile("base=20ms spike(at=3s,for=300ms,150ms)")};
  World world(config, device);
  const std::size_t z = world.add_controller(at_100_hz(), wall());
  world.run_for(milliseconds(2900));
  EXPECT_EQ(told(world).find("late"), std::string::npos);
  world.run_for(seconds(2));
  const std::string text = told(world);
  EXPECT_NE(text.find("the network (round trip 19"), std::string::npos) << text;
  EXPECT_NE(text.find("usually 40 ms)"), std::string::npos) << text;
  world.kill(z);
  world.run_for(milliseconds(1500));
  EXPECT_NE(told(world).find("no datagrams arrive"), std::string::npos);
}

TEST(World, TheServerKnowsTheClockOfTheEngineWithinTheBoundItStates) {
  SimulatedDevice device(pressing_hand());
  World world(world_config(device.info()), device);
  const injector::DriftingClock clock({.offset = std::chrono::hours(30), .drift_ppb = -150'000, .steps = {}});
  world.add_controller(at_100_hz(), wall(), clock);
  world.run_for(seconds(60));
  const auto estimate = world.server().stats().controller_clock;
  ASSERT_TRUE(estimate);
  const Duration error = std::chrono::abs(estimate->offset - (clock.reading(world.now()) - world.now()));
  EXPECT_LE(error, estimate->error_bound);
  EXPECT_LT(error, milliseconds(3));
  EXPECT_LT(estimate->error_bound, milliseconds(25));
}

}  // namespace
}  // namespace tendon::simulation::world_test
