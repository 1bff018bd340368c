// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/field_run.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "core/base/rotation.h"
#include "core/control/preset.h"
#include "core/field/renderer.h"
#include "core/haptic_controller.h"
#include "tests/support/dice.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/named_profiles.h"

namespace tendon::lab {
namespace {

using std::chrono::milliseconds;

constexpr double kEngine = 1 / 60.0;    // s, period
constexpr double kFrom = 0.5;           // s: the errors before are those of the first contact
constexpr double kLate = 3;             // s
constexpr double kMaxForce = 8.5;       // N
constexpr double kMaxStiffness = 2000;  // N/m
constexpr double kSpacing = 1e-3;       // m, of the bricks

LocalTime at_seconds(double t) { return LocalTime(from_seconds(t)); }

const field::BrickField& bricks_of(const FieldScene& scene) {
  static std::map<const FieldScene*, std::unique_ptr<field::BrickField>> all;
  auto& bricks = all[&scene];
  if (!bricks) {
    bricks = std::make_unique<field::BrickField>();
    field::sample([&](const Vec3& x) { return scene.exact.at(x).distance; }, scene.low, scene.high, kSpacing, *bricks);
  }
  return *bricks;
}

bool has_field(const FieldCase& of) { return of.method >= FieldMethod::kField; }

/// What the engine sends. All values are those of the state `tick`.
struct Answer {
  std::uint64_t tick = 0;  ///< 1 is the first step
  double sampled = 0;      ///< s
  Vec3 at = Vec3::Zero();
  Vec3 force = Vec3::Zero();
  Contact contact{};
  field::TimedPose pose{};
};

struct State {
  std::uint64_t tick = 0;
  double sampled = 0;  ///< s
  Vec3 hand = Vec3::Zero();
};

class Engine {
 public:
  explicit Engine(const FieldCase& of) : of_(of), contact_(*of.scene) {}

  Answer answer(double now, const State& state) {
    constexpr int kRounds = 60;
    // The force that a field is compared with is the true one at the time of the state.
    const double then = of_.method == FieldMethod::kLearned ? state.sampled : now;
    Answer answer{.tick = state.tick,
                  .sampled = state.sampled,
                  .at = state.hand,
                  .force = contact_.force(of_.scene->pose_at(then), state.hand, kEngine, kRounds)};
    answer.contact = {.normal = contact_.normal(), .gap = contact_.gap()};
    ForceTable table{.first = contact_.gap(), .step = 1e-3, .size = ForceTable::kMaxEntries};
    for (std::size_t i = 0; i < table.size; ++i)
      table.force[i] = contact_.force_at(static_cast<double>(i) * table.step);
    answer.contact.table = table;
    answer.pose = pose_for(of_.ahead ? now + (now - state.sampled) : now);
    return answer;
  }

 private:
  field::TimedPose pose_for(double t) const {
    constexpr double kHalf = 1e-3;
    field::TimedPose pose{.at = at_seconds(t), .pose = of_.scene->pose_at(t)};
    if (!of_.ahead) return pose;
    const field::Pose before = of_.scene->pose_at(t - kHalf);
    const field::Pose after = of_.scene->pose_at(t + kHalf);
    pose.velocity = (after.position - before.position) / (2 * kHalf);
    pose.angular_velocity = turn_between(before.turn, after.turn) / (2 * kHalf);
    return pose;
  }

  const FieldCase& of_;
  TrueContact contact_;
};

/// One direction of the network.
template <class T>
class Way {
 public:
  Way(const std::string& network, std::uint64_t seed, injector::Direction direction)
      : injector_(injector::resolve_profile(network, direction), seed, 0, direction, LocalTime{}) {}

  void send(double now, const T& what) {
    const injector::Decision fate = injector_.decide({.arrival = at_seconds(now), .size = 200});
    if (fate.verdict != injector::Verdict::kDrop) sent_.emplace(fate.release, what);
  }

  std::optional<T> arrived(double now) {
    if (sent_.empty() || sent_.begin()->first > at_seconds(now)) return std::nullopt;
    const T what = sent_.begin()->second;
    sent_.erase(sent_.begin());
    return what;
  }

 private:
  injector::Injector injector_;
  std::multimap<LocalTime, T> sent_{};
};

/// The haptic thread.
class Device {
 public:
  explicit Device(const FieldCase& of)
      : of_(of),
        field_{.bricks = &bricks_of(*of.scene), .materials = {of.scene->described}},
        controller_(config_of(of)) {
    if (!has_field(of)) return;
    controller_.use({.field = &field_, .generation = kGeneration, .source = kSource}, LocalTime{});
    if (of.scene->pose) controller_.observe(field::TimedPose{.pose = of.scene->pose(0)});
  }

  void observe(const Answer& answer, double now) {
    if (has_field(of_) && of_.scene->pose) controller_.observe(answer.pose);
    if (of_.method == FieldMethod::kField) return;
    RemoteForce force{.sequence = ++sequence_,
                      .answers_tick = answer.tick,
                      .answers = at_seconds(answer.sampled),
                      .received = at_seconds(now),
                      .force = answer.force,
                      .valid_for = milliseconds(200),
                      .source = kSource,
                      .field = has_field(of_) ? kGeneration : 0};
    if (of_.method == FieldMethod::kPlane) {
      const auto& table = *answer.contact.table;
      const double stiffness = std::max(table.force[1] - table.force[0], 0.0) / table.step;
      force.model = {.at = answer.at, .stiffness = stiffness * Mat3::Identity(), .contact = answer.contact};
    }
    controller_.observe(force);
  }

  Step step(const Motion& hand, const Vec3& applied) { return controller_.step(hand, applied); }

 private:
  static constexpr std::uint32_t kGeneration = 1;
  static constexpr std::uint32_t kSource = 1;

  static HapticController::Config config_of(const FieldCase& of) {
    HapticController::Config config;
    config.limiter = {.law = of.method == FieldMethod::kHeld ? Law::kAol : Law::kAolPlus,
                      .friction = field::Body{}.friction,
                      .longest_hold = milliseconds(1)};
    config.max_force = kMaxForce;
    config.max_slew = std::numeric_limits<double>::infinity();
    if (of.method == FieldMethod::kHeld) return config;
    config.limiter.parts =
        preset_parts(Preset::kFeel, {config.limiter.friction, config.limiter.longest_hold, of.count}).parts;
    config.limiter.shared_account = of.push.push_j > 0 || of.push.push_w > 0;
    if (has_field(of)) config.hold.field = field::Renderer::Config{.max_stiffness = kMaxStiffness, .push = of.push};
    return config;
  }

  const FieldCase& of_;
  field::Field field_;
  HapticController controller_;
  std::uint64_t sequence_ = 0;
};

Vec3 counted(const Vec3& x, double count) {
  if (!(count > 0)) return x;
  return (x / count).array().round().matrix() * count;
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
  Way<State> up(of.network, of.seed, injector::Direction::kUp);
  Way<Answer> down(of.network, of.seed, injector::Direction::kDown);
  Dice dice(of.seed);
  FieldHand hand = field_hand(of.seed);
  field::Body& body = hand.body;
  body.x = of.scene->target(0, hand);
  Engine engine(of);
  Device device(of);
  State seen{.hand = body.x};  // the engine was there before
  double next = kEngine * dice.uniform();
  Vec3 applied = Vec3::Zero();
  Vec3 last = body.x;
  double energy = 0;
  double wrong[2] = {0, 0};
  double all[2] = {0, 0};
  FieldRun run;
  for (int k = 0; k < of.milliseconds; ++k) {
    const double t = k * 1e-3;
    const auto i = static_cast<std::size_t>(k);
    const Vec3 dx = body.x - last;
    last = body.x;
    energy += -applied.dot(dx) + body.friction.coulomb * dx.norm() + body.friction.viscous * dx.squaredNorm() / 1e-3;
    run.least_energy = std::min(run.least_energy, energy);
    const Vec3 measured = counted(body.x, of.count);
    up.send(t, {.tick = i + 1, .sampled = t, .hand = measured});
    for (; next <= t; next += kEngine) {
      while (const auto state = up.arrived(next)) {
        if (state->tick > seen.tick) seen = *state;
      }
      const Answer answer = engine.answer(next, seen);
      if (!dice.chance(of.loss)) down.send(next, answer);
    }
    while (const auto answer = down.arrived(t)) device.observe(*answer, t);
    const Step step = device.step({.at = at_seconds(t), .position = measured, .velocity = body.v}, applied);
    if (step.field) {
      energy += step.field->credit;
      run.tank += step.field->credit;
      if (step.field->refused > 1e-9) run.bound += 1.0 / of.milliseconds;
    }
    if (t > kFrom) {
      for (const bool late : {false, true}) {
        if (late && t < kLate) continue;
        wrong[late ? 1 : 0] += (step.force - truth.at(i)).squaredNorm();
        all[late ? 1 : 0] += truth[i].squaredNorm();
      }
      run.jump = std::max(run.jump, (step.force - applied).norm());
      run.true_jump = std::max(run.true_jump, (truth[i] - truth[i - 1]).norm());
    }
    applied = step.force;
    run.force.push_back(applied);
    body.go(applied, of.scene->target(t, hand), of.scene->speed_at(t, hand));
  }
  run.error = std::sqrt(wrong[0] / all[0]);
  run.late_error = std::sqrt(wrong[1] / all[1]);
  return run;
}

}  // namespace tendon::lab
