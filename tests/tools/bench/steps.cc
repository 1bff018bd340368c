// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>

#include "core/base/rotation.h"
#include "core/estimation/velocity_estimator.h"
#include "core/exchange/spsc_ring.h"
#include "core/field/renderer.h"
#include "core/haptic_controller.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/output_bound.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "server/recording/records.h"
#include "server/recording/step_flight.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/bench/other_process.h"
#include "tests/tools/lab/experiments/paper.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};
constexpr std::size_t kCalls = 1000;

struct Place {
  Vec3 position = Vec3::Zero();
  double turn = 0;  ///< rad; also used as the gripper's opening
  Quat orientation;
};

/// A hand on a stiff wall; the limiter acts in half of the steps.
std::array<Place, 2048> hand() {
  std::array<Place, 2048> places;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto phase = static_cast<double>(i) / static_cast<double>(places.size());
    const double x = 0.015 * (phase < 0.5 ? 4 * phase - 1 : 3 - 4 * phase);
    places[i] = {.position = {x, 0.1 * x, 0}, .turn = 20 * x, .orientation = rotation_by({20 * x, 0, 0})};
  }
  return places;
}

class NoSink : public ByteSink {
 public:
  bool append(std::span<const std::byte> bytes) override {
    bytes_ += bytes.size();
    return true;
  }
  std::string error() const override { return {}; }

 private:
  std::size_t bytes_ = 0;
};

HapticController::Config controller_config(Law law, const AolPlus<1, 3>::Parts& parts) {
  HapticController::Config config;
  config.limiter.law = law;
  config.limiter.parts = parts;
  config.limiter.friction = kFriction;
  config.limiter.longest_hold = milliseconds(1);
  config.max_force = 8.5;
  config.max_slew = 1000;
  return config;
}

class Heart {
 public:
  Heart(const HapticController::Config& config, bool whole)
      : whole_(whole), heart_(whole ? with_motors(config) : config) {}

  void step(const Place& place) {
    now_ += milliseconds(1);
    const Vec3& x = place.position;
    const double turn = place.turn;
    if (++steps_ % 10 == 0) {
      RemoteForce force;
      force.sequence = steps_;
      force.received = now_;
      force.force = -3000 * x;
      force.valid_for = milliseconds(30);
      if (whole_) {
        force.torque = RemoteTorque{.torque = Vec3(-0.5 * turn, 0, 0), .model = {}};
        force.grip_force = -10 * turn;
      }
      heart_.observe(force);
    }
    if (whole_) {
      handle_.turning->orientation = place.orientation;
      handle_.grip->opening = turn;
    }
    Step result = heart_.step({now_, x, Vec3::Zero()}, held_, {}, whole_ ? &handle_ : nullptr);
    held_ = result.force;
    if (const TurnStep* const turned = result.turn()) handle_.torque = turned->torque;
    if (const GripStep* const gripped = result.grip()) handle_.grip_force = gripped->force;
    keep(result);
  }

 private:
  static HapticController::Config with_motors(HapticController::Config config) {
    config.rotation =
        RotationLimits{.friction = {1e-4, 1e-3}, .max_torque = 0.3, .max_slew = 100, .encoder_step = 1e-4};
    config.grip = GripLimits{.friction = kFriction, .arm = 0.05, .max_force = 5};
    return config;
  }

  bool whole_;
  HapticController heart_;
  HandleSample handle_{.turning = Turning{}, .grip = Grip{}};
  Vec3 held_ = Vec3::Zero();
  LocalTime now_{};
  std::uint64_t steps_ = 0;
};

}  // namespace

void measure_steps(Run& run) {
  const AtPriority high(run.options.priority);
  const std::size_t blocks = run.options.quick ? 20 : 3000;
  const auto places = hand();

  // Each operation depends on the previous one, as a step depends on the previous step's force.
  const std::string root = "a square root and a divide, each after the other";
  double chained = 2;
  const auto square_root_and_divide = [&](std::size_t) {
    chained = 3 / (1 + std::sqrt(chained));
    keep(chained);
  };

  EnergyLedger ledger(kFriction);
  const OutputBound bound = OutputBound::of(kFriction, milliseconds(1));
  Vec3 applied = Vec3::Zero();
  std::size_t at = 0;
  Row row = row_of(in_turns(
                       blocks, kCalls,
                       [&](std::size_t) {
                         const Vec3& before = places[at % places.size()].position;
                         const Vec3& x = places[++at % places.size()].position;
                         const double energy = ledger.observe(applied, Vec3(x - before), milliseconds(1));
                         applied = bound.limit<3>(Vec3(-3000 * x), energy).force;
                         keep(applied);
                       },
                       square_root_and_divide),
                   "EnergyLedger + OutputBound, 3 DOF", root);
  row.target = Row::Target{"≤ 12 ns", row.p50 <= 12};
  run.add(row);

  VelocityEstimator estimator(30e-6);
  LocalTime now{};
  row = row_of(in_turns(
                   blocks, kCalls,
                   [&](std::size_t) {
                     now += milliseconds(1);
                     Vec3 v = estimator.observe(now, places[++at % places.size()].position);
                     keep(v);
                   },
                   square_root_and_divide),
               "VelocityEstimator::observe, 3 DOF", root);
  row.target = Row::Target{"≤ 40 ns", row.p50 <= 40};
  run.add(row);

  const AolPlus<1, 3>::Parts parts = lab::default_parts(lab::kPaperEncoder);
  const auto controller = [&](const char* what, const HapticController::Config& config) {
    Heart heart(config, false);
    return row_of(
        in_turns(
            blocks, kCalls, [&](std::size_t) { heart.step(places[++at % places.size()]); }, square_root_and_divide),
        what, root);
  };
  run.add(controller("HapticController::step, AOL", controller_config(Law::kAol, {})));
  row = controller("HapticController::step, AOL+ with its default parts", controller_config(Law::kAolPlus, parts));
  row.target = Row::Target{"≤ 150 ns", row.p50 <= 150};
  run.add(row);

  Heart handle(controller_config(Law::kAolPlus, parts), true);
  Heart point(controller_config(Law::kAolPlus, parts), false);
  row = row_of(in_turns(
                   blocks, kCalls, [&](std::size_t) { handle.step(places[++at % places.size()]); },
                   [&](std::size_t) { point.step(places[++at % places.size()]); }),
               "… of a handle that turns and grips: a wrench and a gripper", "the same step of a point");
  run.add(row);

  // A proxy that slides on a sphere of bricks with friction, 1 mm deep.
  field::BrickField bricks;
  field::sample([](const Vec3& x) { return x.norm() - 0.03; }, Vec3::Constant(-0.035), Vec3::Constant(0.035), 1e-3,
                bricks);
  const field::Field shape{.bricks = &bricks, .materials = {{.stiffness = 1000, .friction = 0.3}}};
  const auto renderer = std::make_unique<field::Renderer>(field::Renderer::Config{});
  renderer->use(&shape, now);
  row = row_of(in_turns(
                   blocks, kCalls,
                   [&](std::size_t) {
                     now += milliseconds(1);
                     const Vec3& x = places[++at % places.size()].position;
                     const Vec3 pressed = 0.029 * Vec3(x.x(), 5 * x.y(), 0.02).normalized();
                     auto rendered = renderer->render({now, pressed, Vec3::Zero()}, 1, at);
                     keep(rendered);
                   },
                   square_root_and_divide),
               "field::Renderer::render, bricks", root);
  row.target = Row::Target{"p99 ≤ 1 µs", row.p99 <= 1000};
  run.add(row);

  StepRecord record;
  StepRecord copy;
  const std::string copying = "memcpy of a StepRecord, " + std::to_string(sizeof(StepRecord)) + " bytes";
  const auto copy_record = [&](std::size_t) {
    keep(record);
    std::memcpy(static_cast<void*>(&copy), &record, sizeof copy);
    keep(copy);
  };
  SpscRing<StepRecord> ring(1024);
  StepFlight flight(1024);
  run.add(row_of(in_turns(
                     blocks, kCalls,
                     [&](std::size_t) {
                       ++record.tick;
                       keep(record);
                       ring.try_push(record);
                       flight.record(record);
                       ring.pop();
                     },
                     copy_record),
                 "recording a step: the haptic thread's share", copying));

  NoSink sink;
  Recorder recorder({.scene = {}, .started = {}}, sink);
  row = row_of(in_turns(
                   blocks / 4 + 1, kCalls,
                   [&](std::size_t) {
                     ++record.tick;
                     record.hand.at += milliseconds(1);
                     record.hand.position = places[record.tick % places.size()].position;
                     recorder.record(record);
                     recorder.tick(record.hand.at);
                   },
                   copy_record),
               "… the log thread's: Recorder::record into no file", copying);
  row.note = "protobuf, MCAP, its index and its checksums; on a thread that no force waits for";
  run.add(row);
}

}  // namespace tendon::bench
