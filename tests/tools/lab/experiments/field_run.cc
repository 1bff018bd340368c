// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/field_run.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>

#include "clients/cpp/force_client.h"
#include "devices/device.h"
#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/lab/experiments/field_engine.h"
#include "tests/tools/worlds/world.h"

namespace tendon::lab {
namespace {

using simulation::World;

constexpr double kSpacing = 1e-3;  // m, of the bricks

/// The reading of an encoder; count 0: exact
Vec3 counted(const Vec3& x, double count) {
  if (!(count > 0)) return x;
  return (x / count).array().round().matrix() * count;
}

/// A simulated handle and a hand. If the object moves, the hand is not near it until 1 s before `begin`, because the
/// first pose may not have arrived.
class BodyDevice final : public Device {
 public:
  explicit BodyDevice(const FieldCase& of) : of_(of), hand_(field_hand(of.seed)) {
    hand_.body.x = aim(-1);
    info_.name = "body";
    info_.max_force = 100;
    info_.position_resolution = of.count;
  }

  void begin(LocalTime at) noexcept { begin_ = at; }
  /// s from the start of the motion, negative before it
  double time(LocalTime at) const noexcept { return begin_ ? seconds(at - *begin_) : -1; }
  const Vec3& hand() const noexcept { return hand_.body.x; }

  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    for (; last_ && now - *last_ >= std::chrono::milliseconds(1); *last_ += std::chrono::milliseconds(1)) {
      const double t = time(*last_);
      hand_.body.go(force_, aim(t), t < 0 ? Vec3((aim(t + 1e-3) - aim(t)) / 1e-3) : of_.scene->speed_at(t, hand_));
    }
    if (!last_) last_ = now;
    return PositionSample{.at = now, .position = counted(hand_.body.x, of_.count)};
  }
  Vec3 apply(const Vec3& force) noexcept override { return force_ = force; }

 private:
  Vec3 aim(double t) const {
    const double away = of_.scene->pose ? 0.03 : 0;  // m
    return of_.scene->target(std::max(t, 0.0), hand_) + std::clamp(-t, 0.0, 1.0) * Vec3(0, 0, away);
  }

  const FieldCase& of_;
  FieldHand hand_;
  DeviceInfo info_{};
  std::optional<LocalTime> begin_{};
  std::optional<LocalTime> last_{};
  Vec3 force_ = Vec3::Zero();
};

Field upload_of(const FieldScene& scene) {
  Field field = Field::from([&](const Vec3& x) { return scene.exact.at(x).distance; }, scene.low, scene.high,
                            {.spacing = kSpacing});
  const field::Material& material = scene.described;
  field.materials = {{.stiffness = material.stiffness,
                      .branch_stiffness = material.branch,
                      .relaxation = material.tau,
                      .friction = material.friction}};
  if (!material.table.used) return field;
  FieldDepthTable& table = field.tables.emplace_back();
  table.step = material.table.step;
  table.size = static_cast<std::uint32_t>(table.force.size());
  std::copy(material.table.force.begin() + 1, material.table.force.end(), table.force.begin());
  return field;
}

}  // namespace

std::string_view to_string(FieldMethod method) {
  switch (method) {
    case FieldMethod::kHeld:
      return "held";
    case FieldMethod::kPlane:
      return "plane";
    case FieldMethod::kField:
      return "field";
    case FieldMethod::kLearned:
      break;
  }
  return "learned";
}

FieldRun run_field(const FieldCase& of, const std::vector<Vec3>& truth) {
  BodyDevice device(of);
  World::Config config;
  config.seed = of.seed;
  config.loop.control = field_control(of);
  config.mail.flight = 1;
  const std::string loss = of.loss > 0 ? " loss=" + std::to_string(100 * of.loss) + "%" : "";
  config.weather = {.up = injector::resolve_profile(of.network + loss, injector::Direction::kUp),
                    .down = injector::resolve_profile(of.network, injector::Direction::kDown)};
  World world(config, device);

  FieldEngine engine(of);
  std::optional<std::size_t> handle;
  std::uint64_t answers = 0;
  const auto physics = [&](const DeviceState& state) -> Touch {
    ++answers;
    const double now = device.time(world.now());
    const double sampled = device.time(LocalTime(state.sampled.time_since_epoch()));
    FieldAnswer answer = engine.answer(now, {.tick = state.tick, .sampled = sampled, .hand = state.position});
    if (has_field(of)) {
      if (of.scene->pose) {
        const field::TimedPose& pose = answer.pose;
        world.client(*handle).pose(world.now() + (of.ahead ? from_seconds(now - sampled) : Duration{}),
                                   {.position = pose.pose.position,
                                    .orientation = pose.pose.turn,
                                    .velocity = pose.velocity,
                                    .angular_velocity = pose.angular_velocity});
      }
      if (of.method == FieldMethod::kLearned && sampled >= 0) return Touch::truth(answer.force);
      Touch none;
      none.unknown = true;
      return none;
    }
    Touch touch(answer.force);
    if (of.method == FieldMethod::kPlane) {
      touch.stiffness = answer.model.stiffness;
      touch.contact = answer.model.contact;
    }
    return touch;
  };
  ForceClient::Config client;
  client.name = "engine";
  client.rate_hz = kFieldEngineHz;
  client.state_hz = 1000;
  client.valid_for = std::chrono::milliseconds(200);
  client.fields = has_field(of);
  handle = world.add_controller(client, physics);
  if (has_field(of)) world.client(*handle).use(upload_of(*of.scene));

  FieldScore score(of, truth);
  bool served = false;
  std::size_t steps = 0;
  world.watch_steps([&](const StepRecord& step) {
    served = served || (has_field(of) ? step.field.has_value() : step.force_sequence > 0);
    if (device.time(step.hand.at) < 0) return score.book(device.hand(), step.applied, step.field);
    if (steps == truth.size()) return;
    score.add(device.hand(), step.applied, step.field);
    ++steps;
  });
  constexpr int kMostSeconds = 60;
  for (int s = 0; s < kMostSeconds; ++s) {
    if (served) break;
    world.run_for(std::chrono::seconds(1));
  }
  if (!served) {
    throw std::runtime_error("the server does not render the " + of.scene->name + " of " +
                             std::string(to_string(of.method)) + ": " + world.client(*handle).field().refused);
  }
  constexpr int kApproach = 1500;  // ms; for a new force and a new field, and for the hand
  device.begin(world.now() + std::chrono::milliseconds(kApproach));
  world.run_for(std::chrono::milliseconds(kApproach + of.milliseconds + 1));
  if (steps < truth.size()) throw std::runtime_error("the server has missed steps");
  return score.result();
}

}  // namespace tendon::lab
