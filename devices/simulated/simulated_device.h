// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/motion.h"
#include "core/ledger/friction.h"
#include "devices/device.h"
#include "devices/driver.h"
#include "devices/simulated/forces_under_way.h"
#include "devices/simulated/joint_friction.h"
#include "devices/simulated/operator_hand.h"
#include "devices/simulated/simulated_environment.h"
#include "devices/simulated/simulated_gripper.h"
#include "devices/simulated/simulated_outputs.h"
#include "devices/simulated/simulated_rotation.h"

namespace tendon {

/// A simulated haptic device with a hand on its handle:
///
///     m dv/dt = F_device + F_hand − b v − f_c sgn(v),      sgn(v) = v/|v|;  any |sgn| ≤ 1 at v = 0
///
/// Forces are in N on the handle: F_device is applied to the hand, and F_hand is applied by the hand to the device.
/// Friction is either isotropic or in the joints of a mechanism (JointFriction). All effects are optional, and unused
/// effects cost no time in a substep, because each combination of effects has a separate loop.
///
/// **Structural mode.** Motors, friction and encoder are connected to the handle and the hand by a spring K and a
/// damper C. With the motor side at y = x + e and of mass m − m_h,
///
///     (m − m_h) dẏ/dt = F_device − b ẏ − f_c sgn(ẏ) − K e − C ė,      m_h dv/dt = F_hand + K e + C ė
///
/// If the handle is released, the mode has ω² = K (1/(m − m_h) + 1/m_h), ζ = C ω/(2 K); with the motor side fixed, ω² =
/// K/m_h. Structural resonances reduce the range of impedances that can be rendered (Gil et al., IROS 2010; Çavuşoğlu,
/// Feygin and Tendick, Presence 11(6), 2002). The stiffness felt by the hand cannot exceed K. The maximum damping
/// decreases from about 2 m/T to 2 (m − m_h)/T, and further if the mode is close to the loop rate. The maximum
/// stiffness of a stable sampled spring does not change, because the encoder and the motors are on the same side.
///
/// **Time.** Time 0 is defined by the first call of `read`. Each later `read` integrates up to `now`, using the force
/// of the last `apply`. The encoder and the force are updated at the same time, when `read` is called. If `now`
/// decreases, it is ignored. In longer gaps, only kMaxGap is integrated.
///
/// **Transport delay.** With `sample_delay` d_s, `read(now)` returns the sample at now − d_s, and integrates (and
/// updates `truth()`) up to this time only. With `force_delay` d_f, forces reach the motors later, and the initial
/// force is zero. Both delays are exact to the nanosecond for any period, so a force affects samples after d_s + d_f.
/// The watchdog uses the forces that have arrived.
///
/// **Rotation and gripper** (SimulatedRotation, SimulatedGripper) use the same substeps, delays and watchdog, but have
/// a separate mass and friction, and no amplifier. If a wrench is too large, force and torque are reduced by the same
/// factor, to keep its direction. The grip is limited separately.
///
/// **Environment** (SimulatedEnvironment): the force of walls and a medium on the handle, evaluated in the middle of
/// each substep in time and position. It is also measured by a force sensor.
///
/// **Integration.** Substeps of equal length h ≤ max_substep use the implicit midpoint rule with set-valued friction
/// (Moreau's time stepping with θ = ½). With v̄ = (v₀ + v₁)/2, the following is satisfied exactly:
///
///     m (v₁ − v₀)/h = F_device + F_hand − b v̄ − f_c sgn(v̄),      x₁ = x₀ + h v̄
///
/// where F_hand is evaluated at the midpoint in time, position and velocity. The closed-form solution reduces the
/// half-step momentum p by the friction impulse, and then divides it by mass and damping:
///
///     v̄ = (1 − h f_c/(2|p|))₊ p / (m + (h/2)(b + c + k h/2)),      p = m v₀ + (h/2)(F_device + drive)
///
/// If the velocity reaches or crosses zero and friction can hold the device, it stops: v₁ = 0. Sticking is exact,
/// without a velocity threshold. This rule is stable for any hand. It does not add or remove energy, since m (v₁ −
/// v₀)·v̄ is exactly the change of the kinetic energy. Numerical damping would make all limiters look better than they
/// are: with semi-implicit Euler at 50 µs, springs that are 5 % too stiff for the real device are still stable. In a
/// structural mode, the mean deflection is used for the spring, and both velocities are computed from a linear
/// equation; its frequency is (2/h) atan(ω h/2), 0.03 % low at 200 Hz.
///
/// Energy balance, up to rounding: if the applied force is the one returned (without transport delay, amplifier lag, or
/// an expired watchdog), and an EnergyLedger computes E from the true encoder position and `least_friction`,
///
///     work of hand and environment + stored energy at the start ≥ E + stored energy now
///
/// where stored energy includes the kinetic energy of the device and the energy of the structural mode. With transport
/// delay, this is only true for the forces at the motors, because a delayed spring does generate energy.
class SimulatedDevice final : public Device {
 public:
  struct Config {
    std::string name = "simulated";
    double mass = 0;                     ///< kg, apparent mass at the handle, > 0
    std::optional<Vec3> start_position;  ///< m; default: the position of the hand, or 0
    Vec3 start_velocity = Vec3::Zero();  ///< m/s

    /// Optional effects. The energy balance remains valid unless noted otherwise.
    std::optional<double> viscous_friction;               ///< b, N·s/m, > 0
    std::optional<double> coulomb_friction;               ///< f_c, N, > 0
    std::optional<JointFriction::Config> joint_friction;  ///< instead of `coulomb_friction`
    struct StructuralMode {
      double handle_mass = 0;  ///< m_h, kg; > 0, below `mass`
      double stiffness = 0;    ///< K, N/m, > 0
      double damping = 0;      ///< C, N·s/m, ≥ 0
    };
    std::optional<StructuralMode> structural_mode;
    std::optional<double> encoder_step;         ///< m per count and axis; samples are rounded to multiples
    std::optional<double> max_force;            ///< N, maximum norm
    std::optional<double> amplifier_bandwidth;  ///< Hz, −3 dB: first-order lag of the motors; no energy balance
    /// Between handle and hand, as in devices of admittance type or at the wrist of a robot. Measures the mean force of
    /// hand and environment over the last substep, without noise.
    struct ForceSensor {
      std::optional<double> resolution;  ///< N per count and axis
    };
    std::optional<ForceSensor> force_sensor;
    std::optional<Duration> watchdog;  ///< timeout for ending the force
    /// d_s and d_f, up to kMostDelay. Typically 1 to 2 ms for USB and the loop of a device. No energy balance.
    std::optional<Duration> sample_delay;
    std::optional<Duration> force_delay;

    std::optional<SimulatedEnvironment::Config> environment{};  ///< cannot be used with a structural mode

    std::optional<OperatorHand::Config> hand;
    /// When the hand permanently releases the handle, relative to the first `read`. Its mass is also removed.
    std::optional<Duration> lets_go_after{};
    std::optional<Duration> button_after;  ///< button 0 is held from this time on, relative to the first `read`
    struct Press {
      std::uint32_t button = 0;  ///< bit in PositionSample::buttons, below 32
      Duration from{};           ///< since the first `read`, ≥ 0
      Duration length{};         ///< > 0
    };
    std::vector<Press> presses{};

    std::optional<SimulatedRotation::Config> rotation{};  ///< the energy balance then includes −τ·ω
    std::optional<SimulatedGripper::Config> gripper{};    ///< with its own energy balance
    std::vector<OutputDescription> outputs{};

    /// > 0. 50 µs are 20 substeps per haptic period of 1 kHz. The stiffness limit of a sampled spring (75 g, 1 kHz) is
    /// then accurate to 1.4e-6 at 0.26 N·s/m, and to 2.8e-5 at 5 N·s/m. The error is proportional to the square of this
    /// value. The energy balance is exact for any value.
    Duration max_substep = std::chrono::microseconds(50);
  };

  /// The true state. Only for tests.
  struct Truth {
    Vec3 position = Vec3::Zero();           ///< m, of the handle
    Vec3 velocity = Vec3::Zero();           ///< m/s, of the handle
    Vec3 deflection = Vec3::Zero();         ///< m, e: the encoder is at position + deflection
    Vec3 device_force = Vec3::Zero();       ///< N, mean of last substep
    Vec3 hand_force = Vec3::Zero();         ///< N, mean of last substep
    Vec3 environment_force = Vec3::Zero();  ///< N, mean of last substep
    double hand_work = 0;                   ///< J, ∫ F_hand·dx since the start
    double environment_work = 0;            ///< J, of the environment
    double kinetic_energy = 0;              ///< J, excluding the mass of the hand
    double spring_energy = 0;               ///< J, of the structural mode
    bool watchdog_fired = false;
  };

  /// This is longer than the pauses of a loop that works. Limits the cost of a `read` to 200 000 substeps, about 10 ms.
  static constexpr Duration kMaxGap = std::chrono::seconds(10);

  /// This is fifty times the delay of a bus. It limits the number of forces that are stored.
  static constexpr Duration kMostDelay = std::chrono::milliseconds(100);

  /// Throws std::invalid_argument if a value is out of range, naming the field.
  explicit SimulatedDevice(Config config);

  const DeviceInfo& info() const noexcept override { return info_; }

  std::optional<PositionSample> read(LocalTime now) noexcept override;
  /// With `joint_friction`, at the position returned by `read`.
  Joints joints(const Motion& hand) const noexcept override { return joints_ ? joints_->at(hand) : Joints{}; }

  /// Returns the force after saturation, or zero for infinity and NaN. Also ends torque and grip.
  Vec3 apply(const Vec3& force) noexcept override;

  /// As `apply`. Force and torque are reduced by a common factor. Torque and grip are zero if there is no such motor.
  Effort apply_all(const Effort& effort) noexcept override;

  void set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept override;

  const Truth& truth() const noexcept { return truth_; }
  const SimulatedRotation* rotation() const noexcept { return rotation_ ? &*rotation_ : nullptr; }
  const SimulatedGripper* gripper() const noexcept { return gripper_ ? &*gripper_ : nullptr; }
  const SimulatedOutputs& outputs() const noexcept { return outputs_; }

 private:
  /// Amplifier with the time constant τ, for a substep of length h.
  struct Lag {
    double reached = 1;     ///< 1 − e^(−h/τ)
    double h_over_tau = 0;  ///< h/τ
  };
  enum class Rub : std::uint8_t { kNone, kHandle, kJoints };
  enum class Far : std::uint8_t { kNone, kMode, kEnvironment };  ///< in addition to the hand
  struct Effects {
    Rub rub = Rub::kNone;
    bool hand = false;
    bool lag = false;
    Far far = Far::kNone;

    static constexpr std::size_t kHowMany = 36;
    static constexpr Effects numbered(std::size_t i) {
      return {static_cast<Rub>(i / 12), (i / 6 & 1) != 0, (i / 3 & 1) != 0, static_cast<Far>(i % 3)};
    }
    constexpr std::size_t number() const {
      return 12 * static_cast<std::size_t>(rub) + (hand ? 6U : 0U) + (lag ? 3U : 0U) + static_cast<std::size_t>(far);
    }
  };
  /// In kg. `resistance` also includes h/2 times all damping.
  struct Side {
    double mass = 0;
    double resistance = 0;
  };

  Vec3 sensed_force() const noexcept;
  std::uint32_t pressed() const noexcept;
  // Not inlined, so that other devices only pay for a branch.
  [[gnu::noinline]] Vec3 apply_alone(const Vec3& force) noexcept;
  Effort written(const Effort& effort) const noexcept;
  [[gnu::noinline]] Vec3 send(const Vec3& force) noexcept;
  void hold(const Effort& effort) noexcept;
  [[gnu::noinline]] void hold_torque_and_grip(const Effort& effort) noexcept;
  [[gnu::noinline]] void turn_and_grip(Duration span) noexcept;
  Duration::rep substeps_in(Duration span) const noexcept;
  [[gnu::noinline]] void sense_more(PositionSample& sample) const noexcept;
  void advance(Duration gap) noexcept;
  void live(Duration gap) noexcept;
  Duration live_to_last_arrival(Duration gap) noexcept;
  Duration live_with_watchdog(Duration gap) noexcept;
  void integrate(Duration span) noexcept;
  void move(Duration span) noexcept;
  [[gnu::noinline]] Duration move_until_let_go(Duration span) noexcept;
  void choose_substeps() noexcept;
  using Substeps = void (SimulatedDevice::*)(Duration::rep count, double h) noexcept;
  static Substeps substeps_with(const Effects& effects);
  template <Effects kEffects>
  void take_substeps(Duration::rep count, double h) noexcept;
  template <Rub kRub>
  [[gnu::always_inline]] inline void slide(Vec3& mean, Vec3& velocity, const Side& side, const Vec3& push,
                                           const Vec3& position, double h) const noexcept;
  Vec3 force_over(const Lag& lag) noexcept;
  void settle_energies() noexcept;
  void settle_mode() noexcept;

  Config config_;
  std::optional<OperatorHand> hand_;
  std::optional<SimulatedEnvironment> environment_;
  std::optional<JointFriction> joints_;
  std::optional<SimulatedRotation> rotation_;
  std::optional<SimulatedGripper> gripper_;
  SimulatedOutputs outputs_;
  bool turns_or_grips_ = false;
  bool has_more_ = false;  ///< true if there is a rotation, a gripper or a button press
  Substeps take_substeps_;
  DeviceInfo info_;
  std::optional<LocalTime> last_read_;
  Duration lived_{};             ///< since the first `read`
  Vec3 command_ = Vec3::Zero();  ///< N
  std::optional<ForcesUnderWay> under_way_;
  Vec3 motor_velocity_ = Vec3::Zero();      ///< m/s, ẏ of a structural mode
  std::optional<Vec3> amplifier_force_;     ///< N, lags behind `command_`
  std::optional<Duration> until_watchdog_;  ///< empty if expired or not used
  double drive_work_ = 0;                   ///< J, of the hand's spring and damper
  Truth truth_;
};

/// Lower bounds in all positions and directions, which can be used by a limiter.
Friction least_friction(const SimulatedDevice::Config& config);
/// Lower bounds at `position` (m) in all directions.
Friction least_friction_at(const SimulatedDevice::Config& config, const Vec3& position);

const Driver& driver(const SimulatedDevice::Config& config);
SimulatedDevice::Config stand_in(const SimulatedDevice::Config& config);
std::unique_ptr<Device> make(const SimulatedDevice::Config& config, FromOutside outside);

/// 0.1 kg without other effects, for devices with unknown properties.
SimulatedDevice::Config plain_stand_in(std::string name);

}  // namespace tendon
