// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "core/haptic_controller.h"
#include "devices/simulated/simulated_device.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::lab {

/// An engine that takes time, behind a network that tendon-inject knows. The device's motions go there once a period
/// of its loop; when the engine is free it answers the newest that has come, and never queues.
struct Route {
  injector::Profile there;  ///< of motions
  injector::Profile back;   ///< of forces
  Duration compute{};       ///< for an answer
};

/// A remote environment behind a network, as values in and values out: what it answers to a place and a time. When the
/// clock starts the hand has been resting where it is for so long that the answer to that is already there.
struct Environment {
  using Force = std::function<Vec3(double t, const Vec3& position)>;
  using Stiffness = std::function<Mat3(double t, const Vec3& position)>;
  using Surface = std::function<Contact(double t, const Vec3& position)>;

  Force force;            ///< N, on the hand, `t` seconds after the start: the truth
  Stiffness stiffness{};  ///< −∂F/∂x, N/m, sent along as local model; left out: none is sent
  Surface surface{};      ///< sent along, with its table if it has one; left out: none is sent
  Duration period = std::chrono::milliseconds(1);  ///< of its forces
  Duration delay{};                                ///< from the motion being sampled to the force being there
  Duration jitter{};             ///< at most so much longer; later forces overtake earlier ones, which then are dropped
  double loss = 0;               ///< share of its forces that never arrive
  std::optional<Route> route{};  ///< instead of the four above
  /// N, on the hand, what an environment without error would answer: Moment::true_force. Left out: `force`.
  Force truth{};
};

/// A hand that goes its way whatever it feels. Displayed stiffness is measured on it.
struct PrescribedMotion {
  std::function<Vec3(double t)> position;  ///< m
  Friction friction;                       ///< that the device really has
  double encoder_step = 0;                 ///< m, per axis; 0 = exact
};

/// A simulated device with a hand that feels it. Instability is shown on it.
using FreeHand = SimulatedDevice::Config;

struct Experiment {
  Environment environment;
  std::variant<PrescribedMotion, FreeHand> hand;
  LimiterConfig limiter;  ///< its longest_hold is `period`, its max_force that of the experiment
  std::optional<OutputEstimator::Config> estimator{};   ///< between two forces; left out: the last one is held
  std::optional<LearnedModel::Config> learned_model{};  ///< … or this
  Duration period = std::chrono::milliseconds(1);
  Duration length = std::chrono::seconds(5);
  double max_force = 0;    ///< N
  std::uint64_t seed = 0;  ///< of jitter and loss
};

/// One period: what the controller found and decided, and how things really were when it did.
struct Moment {
  Step step;
  double t = 0;                    ///< s
  Vec3 position = Vec3::Zero();    ///< m, true
  Vec3 velocity = Vec3::Zero();    ///< m/s, true
  Vec3 true_force = Vec3::Zero();  ///< N, Environment::truth here and now
  double energy = 0;               ///< J, of the true ledger: exact positions, the friction that the device has
};

/// What a run comes down to.
struct Outcome {
  double operational_stiffness = 0;  ///< N/m: mean of −(F − F₀)·d/‖d‖², d = x − x₀, where ‖d‖ > a tenth of its largest
  double least_energy = 0;    ///< J, of the true ledger; negative: the device gave out what nobody had put in
  double late_vibration = 0;  ///< m/s, rms of velocity less its mean over 50 ms, in the last second
  double vibration = 0;       ///< m/s, the same in the last four seconds
  double sensation = 0;       ///< dB above what a hand just feels (perception.h), in the last second
  double noticed_share = 0;   ///< of the periods that are judged: a hand tells what it feels from what is true
  double largest_force = 0;   ///< N
  double limited_share = 0;   ///< of the periods: the law changed what was wanted
  double force_error = 0;     ///< N, rms of what is felt less what is true
  double true_force = 0;      ///< N, rms of what is true
  double latency = 0;         ///< s, by which what is felt follows what is true (largest correlation)
  bool stable = false;        ///< late_vibration ≤ kMostVibration
};

/// m/s: a third of the largest speed of a hand that swings 15 mm at 0.25 Hz.
inline constexpr double kMostVibration = 8e-3;

/// Runs HapticController, as it is in the server, against the environment and the hand, on a clock that is only
/// counted. Neither hold, ramp nor slew limit interfere: a force stays until the next one comes.
///
/// The same experiment gives the same record on every machine with the same floating point. Throws what the parts
/// throw when a value is impossible, and std::invalid_argument without an environment.
std::vector<Moment> run(const Experiment& experiment);

/// `period` as in the experiment.
Outcome outcome(const std::vector<Moment>& record, Duration period);

/// Velocity (m/s) less its mean over 50 ms, in the last `last` seconds of the record but for the 25 ms at its end which
/// have no such mean.
std::vector<Vec3> fast_velocity(const std::vector<Moment>& record, Duration period, double last);

/// Standard deviation (m/s) of fast_velocity, its axes summed.
double vibration(const std::vector<Moment>& record, Duration period, double last);

}  // namespace tendon::lab
