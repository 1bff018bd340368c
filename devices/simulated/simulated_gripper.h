// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"
#include "devices/device.h"
#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// The gripper of a simulated handle: two fingers that open by an angle θ, with x = arm · θ the travel of the fingers
/// on each other. Everything moves along x, at the fingers:
///
///     m dv/dt = F_device + F_hand − b v − f_c sgn(v),      0 ≤ x ≤ arm · open;      F > 0 opens
///
/// **The hand** is a spring and a damper, F_hand = k (s − x) + c (ṡ − v), to the opening that it wants. **The stops**
/// at both ends are rigid and take all of the speed: v = 0 there, and the fingers stay until something pulls them away.
///
/// **Integration** is that of SimulatedDevice, the implicit midpoint rule with set-valued friction: it sticks exactly,
/// and neither makes nor hides energy. A substep that would end beyond a stop ends at it. That never makes energy,
/// because all forces but the stop's fall with v: with d = x₁ − x₀ and the mean velocity v̄ that there would be without
/// the stop, |v̄| ≥ |d|/h, the stop takes m v₀²/2 + F·d ≥ m (v₀ − 2 d/h)²/2.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class SimulatedGripper {
 public:
  struct Hand {
    double stiffness = 0;  ///< k, N/m, > 0
    double damping = 0;    ///< c, N·s/m, ≥ 0
    /// The opening that it wants, rad: the x of each position. The other two components do not count.
    ScriptedMotion motion{ScriptedMotion::Sine{}};
  };

  struct Config {
    double open = 0;                           ///< rad, its largest opening, > 0
    double arm = 0;                            ///< m/rad, > 0
    double mass = 0;                           ///< kg, effective, at the fingers, > 0
    std::optional<double> start{};             ///< rad; left out: where the hand starts, or closed
    std::optional<double> viscous_friction{};  ///< b, N·s/m, > 0
    std::optional<double> coulomb_friction{};  ///< f_c, N, > 0
    std::optional<double> max_force{};         ///< N, > 0; left out: it has no motor
    std::optional<double> encoder_step{};      ///< rad, > 0; the sample is the centre of the count, and 0 is a centre
    std::optional<Hand> hand{};
  };

  /// The true state, for tests; no production code may read it.
  struct Truth {
    double position = 0;        ///< m, x
    double velocity = 0;        ///< m/s
    double device_force = 0;    ///< N
    double hand_force = 0;      ///< N, mean over the last substep
    double hand_work = 0;       ///< J, ∫ F_hand dx since the start
    double kinetic_energy = 0;  ///< J
  };

  /// Throws std::invalid_argument naming the field ("gripper.…"), its value and what was expected.
  explicit SimulatedGripper(Config config);

  /// What a data sheet says of it.
  DeviceInfo::Gripper info() const noexcept;

  /// From now on this force (N) is held. It has to be within ± `max_force`, and zero without a motor.
  void hold(double force) noexcept { truth_.device_force = force; }

  /// Integrates `substeps` of `h` seconds each; the first begins `begin` seconds after the start.
  void integrate(double begin, Duration::rep substeps, double h) noexcept;

  /// rad, the opening that the encoder gives.
  double sample() const noexcept;

  const Truth& truth() const noexcept { return truth_; }

 private:
  /// k (s − x) + c ṡ.
  double drive(double t) const noexcept;

  Config config_;
  double most_;  ///< m, x when it is open
  Truth truth_;
};

}  // namespace tendon
