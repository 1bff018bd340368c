// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"
#include "devices/device.h"
#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// The gripper of a simulated handle: two fingers that open by an angle θ, where x = arm · θ is their relative travel.
/// The motion is one-dimensional, along x at the fingers:
///
///     m dv/dt = F_device + F_hand − b v − f_c sgn(v),      0 ≤ x ≤ arm · open;      F > 0 opens
///
/// **The hand** is a spring and a damper towards the desired opening s, F_hand = k (s − x) + c (ṡ − v). **The stops**
/// at both ends are rigid and inelastic: v = 0 there, and the fingers stay until a force pulls them away.
///
/// **Integration** is that of SimulatedDevice, the implicit midpoint rule with set-valued friction. It sticks exactly
/// and conserves energy. A substep that would end beyond a stop ends at it. This never generates energy, because all
/// forces except that of the stop decrease with v: with d = x₁ − x₀ and the mean velocity v̄ without the stop, |v̄| ≥
/// |d|/h, the stop absorbs m v₀²/2 + F·d ≥ m (v₀ − 2 d/h)²/2.
///
/// Thread-safe: no. Realtime-safe: all except the constructor.
class SimulatedGripper {
 public:
  struct Hand {
    double stiffness = 0;  ///< k, N/m, > 0
    double damping = 0;    ///< c, N·s/m, ≥ 0
    /// The desired opening in rad is the x component of each position. The other two components are ignored.
    ScriptedMotion motion{ScriptedMotion::Sine{}};
  };

  struct Config {
    double open = 0;                           ///< rad, largest opening, > 0
    double arm = 0;                            ///< m/rad, > 0
    double mass = 0;                           ///< kg, effective, at the fingers, > 0
    std::optional<double> start{};             ///< rad; empty: the start of the hand's motion, or closed
    std::optional<double> viscous_friction{};  ///< b, N·s/m, > 0
    std::optional<double> coulomb_friction{};  ///< f_c, N, > 0
    std::optional<double> max_force{};         ///< N, > 0; empty: no motor
    std::optional<double> encoder_step{};      ///< rad, > 0; the sample is the centre of the count, and 0 is a centre
    std::optional<Hand> hand{};
  };

  /// The true state, for tests only.
  struct Truth {
    double position = 0;        ///< m, x
    double velocity = 0;        ///< m/s
    double device_force = 0;    ///< N
    double hand_force = 0;      ///< N, mean over the last substep
    double hand_work = 0;       ///< J, ∫ F_hand dx since the start
    double kinetic_energy = 0;  ///< J
  };

  /// Throws std::invalid_argument, naming the field ("gripper.…"), its value and the expected range.
  explicit SimulatedGripper(Config config);

  DeviceInfo::Gripper info() const noexcept;

  /// Holds this force (N) from now on. It must be within ± `max_force`, and zero without a motor.
  void hold(double force) noexcept { truth_.device_force = force; }

  /// Integrates `substeps` of `h` seconds each, starting `begin` seconds after the start.
  void integrate(double begin, Duration::rep substeps, double h) noexcept;

  /// Returns the opening measured by the encoder, rad.
  double sample() const noexcept;

  const Truth& truth() const noexcept { return truth_; }

 private:
  /// Returns k (s − x) + c ṡ.
  double drive(double t) const noexcept;

  Config config_;
  double most_;  ///< m, x of the open gripper
  Truth truth_;
};

}  // namespace tendon
