// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "tests/support/field_engine.h"
#include "tests/support/field_shape.h"
#include "tests/support/property_cases.h"
#include "tests/tools/worlds/adversary.h"
#include "tests/tools/worlds/pressed_wall.h"
#include "tests/tools/worlds/watched_device.h"

namespace tendon::simulation::field_world_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kLength = seconds(3);

/// Objects near the hand. One of them is noise, as of a faulty engine.
const std::vector<FieldShape>& shapes() {
  static const std::vector<FieldShape> kShapes = [] {
    const Vec3 low(-0.032, -0.032, -0.032);
    std::vector<FieldShape> made;
    made.push_back(shape_of(sphere_at(Vec3(0.02, 0, 0), 0.018), low, 4, 2e-3));
    made.push_back(shape_of(sphere_at(Vec3(0.01, 0.01, 0), 0.015), low, 4, 2e-3));
    made.push_back(shape_of([](const Vec3& x) { return 0.003 - x.x(); }, low, 4, 2e-3));
    made.push_back(shape_of([](const Vec3& x) { return 0.02 - x.norm(); }, low, 4, 2e-3));  // a bowl
    FieldShape& noise = made.emplace_back(made.front());
    Dice dice(1);
    for (FieldSender::Brick& brick : noise.bricks) {
      for (std::byte& byte : brick.bytes) byte = static_cast<std::byte>(dice.bits());
    }
    FieldShape& few = made.emplace_back();
    few.primitives.push_back(
        {.shape = field::Capsule{.from = Vec3(0.02, -0.01, 0), .to = Vec3(0.02, 0.01, 0), .radius = 0.015}});
    few.primitives.push_back({.shape = field::Box{.centre = Vec3(0, 0.02, 0), .half = Vec3(0.02, 0.012, 0.02)}});
    return made;
  }();
  return kShapes;
}

struct DrawnFields {
  World::Config config;
  std::variant<SimulatedDevice::Config, AdversaryDevice::Config> device;
  WatchedDevice::Config port;
  std::uint64_t engine_seed = 0;
  double rate_hz = 60;
  bool poses = false;
  bool truths = false;
  Duration restarts{};  ///< without a Bye; 0: never
};

DrawnFields draw(std::uint64_t seed) {
  Dice dice(seed);
  DrawnFields world;
  world.config.seed = seed;
  world.config.mail = {.steps = 16, .flight = 1, .datagrams = 1};
  const double way = dice.within(1, 100);
  const auto profile = injector::parse_profile("delay=uniform(" + std::to_string(way) + "ms," +
                                               std::to_string(way + dice.within(0.1, 30)) + "ms) loss=5% duplicate=2%");
  world.config.weather = {profile, profile};
  HapticController::Config& control = world.config.loop.control;
  control.limiter.law = dice.chance(0.5) ? Law::kAolPlus : Law::kAol;
  control.limiter.friction = {dice.chance(0.3) ? 0.0 : dice.decades(-3, -0.5), dice.decades(-2, 0.3)};
  const bool late = dice.chance(0.3);
  world.config.latest_wake = late ? world.config.loop.period : Duration::zero();
  control.limiter.longest_hold = late ? 2 * world.config.loop.period : world.config.loop.period;
  control.max_force = dice.decades(0, 1.5);
  control.max_slew = dice.chance(0.5) ? 1000 : std::numeric_limits<double>::infinity();
  field::Renderer::Config& field = control.hold.field.emplace();
  field.max_stiffness = dice.decades(2, 4);
  if (dice.chance(0.3)) {
    field.push = {.push_j = dice.decades(-3, -1), .push_w = dice.decades(-2, 0.5)};
    control.limiter.shared_account = true;
  }
  world.port.friction = control.limiter.friction;
  if (dice.chance(0.4)) {
    world.device = AdversaryDevice::Config{
        .friction = control.limiter.friction, .hostility = dice.within(0, 1), .largest_move = dice.decades(-3, -2)};
  } else {
    SimulatedDevice::Config device = moved_falcon(Vec3(dice.within(0.005, 0.02), dice.within(-0.01, 0.01), 0),
                                                  dice.milliseconds(100, 600), dice.milliseconds(0, 200));
    device.coulomb_friction.reset();
    if (control.limiter.friction.coulomb > 0) device.coulomb_friction = control.limiter.friction.coulomb;
    device.viscous_friction = control.limiter.friction.viscous;
    device.encoder_step.reset();
    world.device = device;
  }
  world.engine_seed = dice.bits();
  world.rate_hz = dice.within(20, 120);
  world.poses = dice.chance(0.6);
  world.truths = dice.chance(0.4);
  if (dice.chance(0.3)) world.restarts = dice.milliseconds(500, 2000);
  return world;
}

/// Uploads two objects. Then it swaps, moves and corrects them with random values.
class RandomEngine final : public CustomClient {
 public:
  RandomEngine(Link& link, const Address& server, const DrawnFields& drawn)
      : drawn_(drawn), dice_(drawn.engine_seed), link_(link), server_(server) {}

  LocalTime turn(LocalTime now) override {
    if (!engine_ || (drawn_.restarts > Duration::zero() && now >= restarts_)) restart(now);
    if (now >= due_) {
      due_ = now + from_seconds(1 / drawn_.rate_hz);
      if (engine_->session() != nullptr && engine_->state) act(now);
    }
    return std::min(engine_->turn(now), due_);
  }

  std::uint64_t used = 0;

 private:
  void restart(LocalTime now) {
    engine_ = std::make_unique<FieldEngine>(link_, server_, FieldEngine::Config{.seed = dice_.bits()}, now);
    for (int i = 0; i < 2; ++i) {
      engine_->upload(shapes()[dice_.bits() % shapes().size()]);
    }
    generation_ = 0;
    restarts_ = now + drawn_.restarts;
  }

  void act(LocalTime now) {
    if (dice_.chance(0.3)) use();
    if (dice_.chance(0.01)) engine_->ask(DropField{.field = engine_->uploads.front().field()});
    if (drawn_.poses && dice_.chance(0.8)) {
      const Vec3 turn = dice_.direction() * dice_.within(0, 0.5);
      engine_->move({.time = PeerTime(engine_->state->sampled.time_since_epoch()) + dice_.milliseconds(-100, 100),
                     .position = dice_.direction() * dice_.decades(-4, -1.5),
                     .orientation = unit(Quat{.w = 1, .x = turn.x(), .y = turn.y(), .z = turn.z()}),
                     .velocity = dice_.direction() * dice_.decades(-2, 0.9),
                     .angular_velocity = dice_.direction() * dice_.decades(-1, 1.9)});
    }
    if (drawn_.truths && engine_->state->field) {
      engine_->tell(dice_.direction() * dice_.decades(-1, 1.5), engine_->state->field->generation);
    }
    static_cast<void>(now);
  }

  void use() {
    const FieldSender& chosen = engine_->uploads[dice_.bits() % engine_->uploads.size()];
    if (!chosen.complete()) return;
    const double most = drawn_.config.loop.control.hold.field->max_stiffness;
    FieldMaterial material{.stiffness = most * dice_.within(0.01, 0.6),
                           .friction = dice_.chance(0.5) ? 0 : dice_.within(0, 2)};
    if (dice_.chance(0.4)) {
      material.branch_stiffness = most * dice_.within(0, 0.39);
      material.relaxation = dice_.decades(-2, 1);
    }
    UseField wanted{.generation = generation_ + 1, .field = chosen.field(), .materials = {material}};
    if (dice_.chance(0.3)) {
      wanted.fixtures.push_back({.kind = static_cast<FieldFixtureKind>(1 + dice_.bits() % 3),
                                 .at = dice_.direction() * 0.01,
                                 .normal = dice_.direction(),
                                 .stiffness = most * dice_.within(0.01, 1),
                                 .most_force = dice_.decades(-1, 1)});
    }
    if (dice_.chance(0.4)) {
      FieldDepthTable& table = wanted.tables.emplace_back();
      table.step = dice_.decades(-3.9, -1.1);
      table.size = static_cast<std::uint32_t>(1 + dice_.bits() % table.force.size());
      const double rise = (most - material.stiffness - material.branch_stiffness) * table.step;
      for (std::uint32_t i = 0; i < table.size; ++i) {
        const double change = dice_.within(-0.89 * material.stiffness * table.step, rise);
        table.force[i] = (i == 0 ? 0 : table.force[i - 1]) + change;
      }
    }
    if (engine_->ask(wanted) == 0) return;
    ++generation_;
    ++used;
  }

  const DrawnFields& drawn_;
  Dice dice_;
  Link& link_;
  Address server_;
  std::unique_ptr<FieldEngine> engine_;
  std::uint32_t generation_ = 0;
  LocalTime due_{};
  LocalTime restarts_{};
};

struct Outcome {
  double least = 0;    ///< J, the least energy of the port, including the energy from the tank
  double granted = 0;  ///< J
  std::uint64_t used = 0;
  std::uint64_t touched = 0;  ///< steps
  bool bound = false;         ///< the gate has refused energy
};

/// `more` is a factor of the force of an adversary, which a law that is passive does not expect.
Outcome run(std::uint64_t seed, double more = 1) {
  const DrawnFields drawn = draw(seed);
  std::unique_ptr<Device> device;
  if (const auto* adversary = std::get_if<AdversaryDevice::Config>(&drawn.device)) {
    AdversaryDevice::Config config = *adversary;
    config.more.force = more;
    device = std::make_unique<AdversaryDevice>(config, seed);
  } else {
    device = std::make_unique<SimulatedDevice>(std::get<SimulatedDevice::Config>(drawn.device));
  }
  WatchedDevice port(*device, drawn.port);
  World world(drawn.config, port);
  RandomEngine* engine = nullptr;
  world.add_custom_client([&](Link& link, const Address& server) {
    auto made = std::make_unique<RandomEngine>(link, server, drawn);
    engine = made.get();
    return made;
  });
  Outcome outcome;
  world.watch_steps([&](const StepRecord& step) {
    outcome.least = std::min({outcome.least, step.energy, port.energy() + outcome.granted});
    if (!step.field) return;
    outcome.granted += step.field->credit;
    outcome.touched += step.field->depth > 0 ? 1 : 0;
    outcome.bound |= step.field->refused > 1e-9;
  });
  world.run_for(kLength);
  outcome.used = engine->used;
  return outcome;
}

TEST(FieldWorlds, NoFieldGivesOutMoreThanItsTank) {
  const int worlds = property_cases() / 2;
  double least = 0;
  double granted = 0;
  std::uint64_t used = 0;
  int touched = 0;
  int bound = 0;
  for (int seed = 1; seed <= worlds; ++seed) {
    const Outcome outcome = run(static_cast<std::uint64_t>(seed));
    EXPECT_GE(outcome.least, -1e-9) << "seed " << seed;
    least = std::min(least, outcome.least);
    granted += outcome.granted;
    used += outcome.used;
    touched += outcome.touched > 20 ? 1 : 0;
    bound += outcome.bound ? 1 : 0;
  }
  std::cout << worlds << " worlds of 3 s: " << used << " uses, touched in " << touched << ", the gate refused in "
            << bound << ", the tanks gave " << granted << " J, least energy " << least << " J\n";
  EXPECT_GT(used, static_cast<std::uint64_t>(worlds) * 10);
  EXPECT_GT(touched, worlds / 2);
  EXPECT_GT(bound, worlds / 4);
  EXPECT_GT(granted, 0);
}

TEST(FieldWorlds, ADeviceThatPushesOnePercentHarderIsFound) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) found += run(seed, 1.01).least < -1e-9 ? 1 : 0;
  EXPECT_GT(found, 0);
}

}  // namespace
}  // namespace tendon::simulation::field_world_test
