// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"
#include "devices/device.h"
#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// The gripper of a simulated handle, with an angle θ between two fingers. They move along x = arm · θ:
///
///     m dv/dt = F_device + F_hand − b v − f_c sgn(v),      0 ≤ x ≤ arm · open;      F > 0 opens
///
/// **The hand** is a spring and a damper, F_hand = k (s − x) + c (ṡ − v), with the target opening s. **The stops** are
/// rigid and inelastic: v = 0 there, until a force opens or closes the gripper again.
///
/// **Integration** as in SimulatedDevice, using the implicit midpoint rule with set-valued friction. Substeps end at
/// the stops. This does not generate energy. Let d = x₁ − x₀, and let v̄ be the mean velocity without the stop. All
/// other forces decrease with v and |v̄| ≥ |d|/h, so the stop absorbs m v₀²/2 + F·d ≥ m (v₀ − 2 d/h)²/2.
/// Thread-safe: no. Realtime-safe: all except the constructor.
class SimulatedGripper {
 public:
  struct Hand {
    double stiffness = 0;                           ///< k, N/m, > 0
    double damping = 0;                             ///< c, N·s/m, ≥ 0
    ScriptedMotion motion{ScriptedMotion::Sine{}};  ///< x is the target opening in rad; y and z are ignored
  };

  struct Config {
    double open = 0;                           ///< rad, fully open, > 0
    double arm = 0;                            ///< m/rad, > 0
    double mass = 0;                           ///< kg, at the fingers, > 0
    std::optional<double> start{};             ///< rad; default: the opening of the hand, or 0
    std::optional<double> viscous_friction{};  ///< b, N·s/m, > 0
    std::optional<double> coulomb_friction{};  ///< f_c, N, > 0
    std::optional<double> max_force{};         ///< N, > 0; empty if there is no motor
    std::optional<double> encoder_step{};      ///< rad, > 0; samples are multiples
    std::optional<Hand> hand{};
  };

  struct Truth {
    double position = 0;        ///< m, x
    double velocity = 0;        ///< m/s
    double device_force = 0;    ///< N
    double hand_force = 0;      ///< N, mean during the last substep
    double hand_work = 0;       ///< J, ∫ F_hand dx since the start
    double kinetic_energy = 0;  ///< J
  };

  /// Throws std::invalid_argument if a value is out of range, naming the field ("gripper.…").
  explicit SimulatedGripper(Config config);

  DeviceInfo::Gripper info() const noexcept;

  /// In N, within ± `max_force`; zero without a motor.
  void hold(double force) noexcept { truth_.device_force = force; }

  /// Integrates `substeps` of `h` seconds, starting at `begin`.
  void integrate(double begin, Duration::rep substeps, double h) noexcept;

  double sample() const noexcept;  ///< rad, as measured by the encoder

  const Truth& truth() const noexcept { return truth_; }

 private:
  double drive(double t) const noexcept;  ///< k (s − x) + c ṡ

  Config config_;
  double most_;  ///< m, fully open
  Truth truth_;
};

}  // namespace tendon
