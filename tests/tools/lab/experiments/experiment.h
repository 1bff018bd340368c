// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "core/haptic_controller.h"
#include "devices/simulated/simulated_device.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::lab {

/// The device sends its motion once per engine period; a free engine answers the newest one that arrived, without a
/// queue.
struct Route {
  injector::Profile there;  ///< for motions
  injector::Profile back;   ///< for forces
  Duration compute{};       ///< per answer
};

/// When the clock starts, the hand is at rest, and the answer to its position has already arrived.
struct Environment {
  using Force = std::function<Vec3(double t, const Vec3& position)>;
  using Stiffness = std::function<Mat3(double t, const Vec3& position)>;
  using Surface = std::function<Contact(double t, const Vec3& position)>;

  Force force;                                     ///< N, on the hand, `t` seconds after the start: the truth
  Stiffness stiffness{};                           ///< −∂F/∂x, N/m, sent as local model; empty: not sent
  Surface surface{};                               ///< sent with its table, if any; empty: not sent
  Duration period = std::chrono::milliseconds(1);  ///< of its forces
  Duration delay{};                                ///< from sampling a motion to the arrival of its force
  Duration jitter{};             ///< maximum additional delay; a force that is overtaken by a later one is dropped
  double loss = 0;               ///< fraction of forces lost
  std::optional<Route> route{};  ///< replaces the four above
  /// The error-free answer, see Moment::true_force. Empty: `force`.
  Force truth{};
};

/// A hand on a prescribed path, independent of forces; used to measure displayed stiffness.
struct PrescribedMotion {
  std::function<Vec3(double t)> position;  ///< m
  Friction friction;                       ///< true friction of the device
  double encoder_step = 0;                 ///< m, per axis; 0 = exact
};

/// Responds to forces; shows instability.
using FreeHand = SimulatedDevice::Config;

struct Experiment {
  Environment environment;
  std::variant<PrescribedMotion, FreeHand> hand;
  LimiterConfig limiter;  ///< longest_hold is set to `period`, max_force to that of the experiment
  /// Used between two forces. If there is neither an estimator nor a model, the last force is held.
  std::optional<OutputEstimator::Config> estimator{};
  std::optional<LearnedModel::Config> learned_model{};
  Duration period = std::chrono::milliseconds(1);
  Duration length = std::chrono::seconds(5);
  double max_force = 0;    ///< N
  std::uint64_t seed = 0;  ///< for jitter and loss
};

struct Moment {
  Step step;
  double t = 0;                    ///< s
  Vec3 position = Vec3::Zero();    ///< m, true
  Vec3 velocity = Vec3::Zero();    ///< m/s, true
  Vec3 true_force = Vec3::Zero();  ///< N, the value of Environment::truth at this position and time
  double energy = 0;               ///< J, true ledger: exact positions and the device's true friction
};

struct Outcome {
  double operational_stiffness = 0;  ///< N/m: mean of −(F − F₀)·d/‖d‖², d = x − x₀, where ‖d‖ > a tenth of its largest
  double least_energy = 0;    ///< J, of the true ledger. If it is negative, the device has generated energy.
  double late_vibration = 0;  ///< m/s, the rms of the velocity minus its mean over 50 ms, in the last second
  double vibration = 0;       ///< m/s, the same in the last four seconds
  double sensation = 0;       ///< dB above what a hand just feels (perception.h), in the last second
  double noticed_share = 0;   ///< fraction of the judged periods in which the hand notices the force error
  double largest_force = 0;   ///< N
  double limited_share = 0;   ///< the fraction of the periods in which the law changes the force
  double force_error = 0;     ///< N, rms of felt minus true force
  double true_force = 0;      ///< rms of the true force, N
  double latency = 0;         ///< s, the delay that maximizes the correlation with the true force
  bool stable = false;        ///< late_vibration ≤ kMostVibration
};

/// m/s: a third of the peak speed of a hand that moves by 15 mm at 0.25 Hz.
inline constexpr double kMostVibration = 8e-3;

/// The server's HapticController on a virtual clock. The hold, ramp and slew limits are disabled, so a force is held
/// until the next one arrives. Deterministic on machines with the same floating point. Throws the exceptions of the
/// parts if a value is not valid, and std::invalid_argument if there is no environment.
std::vector<Moment> run(const Experiment& experiment);

/// Does the same as run(), but only one period in each call, so that the caller can move a Guided hand. `length` is not
/// used.
class LiveRun {
 public:
  explicit LiveRun(const Experiment& experiment);
  LiveRun(LiveRun&&) = delete;
  ~LiveRun();

  Moment step();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The `period` must be the one of the experiment.
Outcome outcome(const std::vector<Moment>& record, Duration period);

/// Velocity (m/s) minus its mean over 50 ms, for the last `last` seconds but their final 25 ms, which have no such
/// mean.
std::vector<Vec3> fast_velocity(const std::vector<Moment>& record, Duration period, double last);

/// Standard deviation (m/s) of fast_velocity, summed over axes.
double vibration(const std::vector<Moment>& record, Duration period, double last);

}  // namespace tendon::lab
