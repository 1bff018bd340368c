// SPDX-License-Identifier: Apache-2.0
// One haptic step, and the parts that it is made of.
#include <array>
#include <chrono>
#include <cmath>
#include <cstring>

#include "core/estimation/velocity_estimator.h"
#include "core/exchange/flight_recorder.h"
#include "core/exchange/spsc_ring.h"
#include "core/haptic_controller.h"
#include "core/ledger/energy_ledger.h"
#include "core/ledger/output_bound.h"
#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "server/recording/records.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/measure.h"
#include "tests/tools/lab/experiments/paper.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};
constexpr std::size_t kCalls = 1000;

/// A hand on a stiff wall: the limiter has work to do in half of the steps.
std::array<Vec3, 2048> hand() {
  std::array<Vec3, 2048> places;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto phase = static_cast<double>(i) / static_cast<double>(places.size());
    const double x = 0.015 * (phase < 0.5 ? 4 * phase - 1 : 3 - 4 * phase);
    places[i] = {x, 0.1 * x, 0};
  }
  return places;
}

/// Takes all and keeps nothing.
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

}  // namespace

void measure_steps(Run& run) {
  const AtPriority high(run.options.priority);
  const std::size_t blocks = run.options.quick ? 20 : 3000;
  const auto places = hand();

  // Each waits for the one before, as a step does for the force of the step before.
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
                         const Vec3& before = places[at % places.size()];
                         const Vec3& x = places[++at % places.size()];
                         const double energy = ledger.observe(applied, Vec3(x - before), milliseconds(1));
                         applied = bound.limit<3>(Vec3(-3000 * x), energy).force;
                         keep(applied);
                       },
                       square_root_and_divide),
                   "EnergyLedger + OutputBound, 3 DOF", root);
  row.target = Row::Target{"≤ 15 ns, ≤ 4 × the floor", row.p50 <= 15 && *row.ratio <= 4};
  run.add(row);

  VelocityEstimator estimator(30e-6);
  LocalTime now{};
  run.add(row_of(in_turns(
                     blocks, kCalls,
                     [&](std::size_t) {
                       now += milliseconds(1);
                       Vec3 v = estimator.observe(now, places[++at % places.size()]);
                       keep(v);
                     },
                     square_root_and_divide),
                 "VelocityEstimator::observe, 3 DOF", root));

  const auto controller = [&](const char* what, Law law, const AolPlus<1, 3>::Parts& parts) {
    HapticController heart(controller_config(law, parts));
    Vec3 held = Vec3::Zero();
    LocalTime time{};
    std::uint64_t step = 0;
    return row_of(in_turns(
                      blocks, kCalls,
                      [&](std::size_t) {
                        time += milliseconds(1);
                        const Vec3& x = places[++step % places.size()];
                        if (step % 10 == 0) {  // a 100 Hz engine
                          RemoteForce force;
                          force.sequence = step;
                          force.received = time;
                          force.force = -3000 * x;
                          force.valid_for = milliseconds(30);
                          heart.observe(force);
                        }
                        Step result = heart.step({time, x, Vec3::Zero()}, held);
                        held = result.force;
                        keep(result);
                      },
                      square_root_and_divide),
                  what, root);
  };
  run.add(controller("HapticController::step, AOL", Law::kAol, {}));
  row = controller("HapticController::step, AOL+ with its default parts", Law::kAolPlus,
                   lab::default_parts(lab::kPaperEncoder));
  row.target = Row::Target{"≤ 300 ns", row.p50 <= 300};
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
  FlightRecorder<StepRecord> flight(1024);
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
                     record.hand.position = places[record.tick % places.size()];
                     recorder.record(record);
                     recorder.tick(record.hand.at);
                   },
                   copy_record),
               "… the log thread's: Recorder::record into no file", copying);
  row.note = "protobuf, MCAP, its index and its checksums; on a thread that no force waits for";
  run.add(row);
}

}  // namespace tendon::bench
