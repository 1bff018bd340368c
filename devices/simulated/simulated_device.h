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

/// A simulated haptic device with an operator's hand on its handle, given by the equation of motion
///
///     m dv/dt = F_device + F_hand − b v − f_c sgn(v),      sgn(v) = v/|v|;  any |sgn| ≤ 1 at v = 0
///
/// with forces in N on the handle. F_device is the force of the device on the hand, F_hand the force of the hand on the
/// device. Friction is isotropic or that of the joints of a mechanism (JointFriction). The device has exactly the
/// effects that its configuration lists. An omitted effect costs nothing in a substep, because each combination of
/// effects has its own loop.
///
/// **A structural mode** divides the mass. Motors, friction and encoder are on one side of a spring K and damper C,
/// handle and hand on the other. With the motor side at y = x + e and of mass m − m_h,
///
///     (m − m_h) dẏ/dt = F_device − b ẏ − f_c sgn(ẏ) − K e − C ė,      m_h dv/dt = F_hand + K e + C ė
///
/// If the handle is released, the mode oscillates at ω² = K (1/(m − m_h) + 1/m_h), ζ = C ω/(2 K); with the motor side
/// fixed, at ω² = K/m_h. Structural resonances reduce the range of impedances that a device can render (Gil et al.,
/// IROS 2010; Çavuşoğlu, Feygin and Tendick, Presence 11(6), 2002). Here the hand never feels a stiffness above K. The
/// maximum damping that can be rendered falls from about 2 m/T to 2 (m − m_h)/T, and further if the mode is close to
/// the loop rate. The maximum stable stiffness of a sampled spring is unchanged, because encoder and motors are on the
/// same side.
///
/// **Time.** The first `read` defines time 0. Each later one integrates up to its `now` with the force of the last
/// `apply`. Encoder and force change at the same time, that of the last `read`. Time that goes backwards has no effect.
/// If a gap is longer than kMaxGap, only that much is integrated and the rest is skipped.
///
/// **Transport delay.** With `sample_delay` d_s, `read(now)` returns the sample taken at now − d_s, which is its `at`.
/// The integration, and with it `truth()`, ends at that time: read now − d_s for now above. With `force_delay` d_f, the
/// force returned by `apply` reaches the motors that much later; there is no force before the first one arrives. Both
/// delays are exact to the nanosecond for any period. A sample shows the first effect of a force d_s + d_f after it was
/// applied. The watchdog of the device counts the forces that arrive.
///
/// **Rotation and gripper** (SimulatedRotation, SimulatedGripper) are integrated in the same substeps and share nothing
/// else with the position: no mass, no friction, no amplifier. Delays and the watchdog apply to torque and grip as
/// well. If a wrench is too large, force and torque are reduced by the same factor, so that it keeps its direction; the
/// grip is clamped separately.
///
/// **The environment** (SimulatedEnvironment) consists of walls and a medium at the handle. It adds a force on the
/// right-hand side, which a force sensor also measures. It is evaluated at the midpoint of a substep in time and
/// position.
///
/// **Integration.** Substeps of equal length h ≤ max_substep, each an implicit midpoint rule with set-valued friction
/// (Moreau's time stepping with θ = ½). With v̄ = (v₀ + v₁)/2 it satisfies, exactly,
///
///     m (v₁ − v₀)/h = F_device + F_hand − b v̄ − f_c sgn(v̄),      x₁ = x₀ + h v̄
///
/// where F_hand is evaluated at the midpoint in time, position and velocity. The solution has a closed form: the
/// half-step momentum p is reduced by the friction impulse, then divided by mass and damping,
///
///     v̄ = (1 − h f_c/(2|p|))₊ p / (m + (h/2)(b + c + k h/2)),      p = m v₀ + (h/2)(F_device + drive)
///
/// If the velocity reaches or crosses zero and friction can hold the pushing force, the device comes to rest: v₁ = 0.
/// It sticks exactly, without a velocity threshold, in any direction. This rule is used because it is stable for any
/// hand and neither generates nor dissipates energy: m (v₁ − v₀)·v̄ is exactly the change of kinetic energy. An
/// integrator with numerical damping would make every limiter look better than it is; semi-implicit Euler at 50 µs
/// stabilizes springs that are 5 % too stiff for the real device. With a structural mode, the spring force is that of
/// the mean deflection, and both velocities follow from one linear equation; the mode oscillates at (2/h) atan(ω h/2),
/// 0.03 % low at 200 Hz. Consequently, while the force held is the force returned (no transport delay, no amplifier
/// lag, no expired watchdog), with E of an EnergyLedger that receives the true position at the encoder and
/// `least_friction`, up to rounding,
///
///     work of hand and environment + stored energy at the start ≥ E + stored energy now
///
/// where the stored energy is the kinetic energy of the device and that of the spring between its masses. With
/// transport delay, this holds for the forces that have reached the motors and not for those returned: a delayed spring
/// does generate energy.
class SimulatedDevice final : public Device {
 public:
  struct Config {
    std::string name = "simulated";
    double mass = 0;                     ///< kg, apparent mass at the handle, > 0
    std::optional<Vec3> start_position;  ///< m; empty: the start of the hand's motion, or the origin
    Vec3 start_velocity = Vec3::Zero();  ///< m/s

    /// Optional effects, each > 0.
    std::optional<double> viscous_friction;  ///< b, N·s/m
    std::optional<double> coulomb_friction;  ///< f_c, N
    /// Friction in the joints, instead of `coulomb_friction`. The energy balance remains valid.
    std::optional<JointFriction::Config> joint_friction;
    /// The hand holds a part of the mass that is on a spring, see above. The energy balance remains valid.
    struct StructuralMode {
      double handle_mass = 0;  ///< m_h, kg, part of `mass`; > 0 and below it
      double stiffness = 0;    ///< K, N/m, > 0
      double damping = 0;      ///< C, N·s/m, ≥ 0
    };
    std::optional<StructuralMode> structural_mode;
    /// m, one encoder count per axis. The sample is the centre of the count, so its error is at most half a count; the
    /// origin is a centre.
    std::optional<double> encoder_step;
    std::optional<double> max_force;  ///< N, norm of the force vector; its direction is preserved
    /// Hz, −3 dB, first order. The motors follow the force returned by `apply` with this lag.
    std::optional<double> amplifier_bandwidth;
    /// A sensor between handle and hand, as in devices of admittance type and at the wrist of robots. It measures the
    /// mean force of hand and environment over the last substep, without noise. The energy balance remains valid.
    struct ForceSensor {
      std::optional<double> resolution;  ///< N, one count per axis; the sample is the centre of the count
    };
    std::optional<ForceSensor> force_sensor;
    std::optional<Duration> watchdog;  ///< time without an `apply` after which the force is zero until the next one
    /// d_s and d_f, each up to kMostDelay. USB and the loop of a device take 1 to 2 ms. The energy balance is not
    /// valid.
    std::optional<Duration> sample_delay;
    std::optional<Duration> force_delay;

    /// Walls and a medium at the handle; not with a structural mode. The energy balance remains valid.
    std::optional<SimulatedEnvironment::Config> environment{};

    std::optional<OperatorHand::Config> hand;
    /// Time after the first `read` at which the hand permanently releases the handle; its mass leaves with it.
    std::optional<Duration> lets_go_after{};
    std::optional<Duration> button_after;  ///< time after the first `read` at which the hand presses and holds button 0
    struct Press {
      std::uint32_t button = 0;  ///< bit in PositionSample::buttons, below 32
      Duration from{};           ///< since the first `read`, ≥ 0
      Duration length{};         ///< > 0
    };
    std::vector<Press> presses{};

    /// The handle also rotates, and every sample has an orientation. The energy balance then includes −τ·ω.
    std::optional<SimulatedRotation::Config> rotation{};
    /// The handle has a gripper, which has its own energy balance.
    std::optional<SimulatedGripper::Config> gripper{};
    std::vector<OutputDescription> outputs{};  ///< lamps and vibration, at most kMostOutputs

    /// > 0. 50 µs gives 20 substeps per haptic period at 1 kHz. The stiffness at which a sampled spring becomes
    /// unstable (75 g, 1 kHz) is then accurate to 1.4e-6 at 0.26 N·s/m and to 2.8e-5 at 5. The error is proportional to
    /// the square of the substep and the cost to its inverse; the energy balance is exact for any value.
    Duration max_substep = std::chrono::microseconds(50);
  };

  /// The true state, for tests only.
  struct Truth {
    Vec3 position = Vec3::Zero();      ///< m, of the handle
    Vec3 velocity = Vec3::Zero();      ///< m/s, of the handle
    Vec3 deflection = Vec3::Zero();    ///< m, e: the encoder is at position + deflection; 0 without a structural mode
    Vec3 device_force = Vec3::Zero();  ///< N, mean over the last substep, on the handle
    Vec3 hand_force = Vec3::Zero();    ///< N, mean over the last substep, on the handle
    Vec3 environment_force = Vec3::Zero();  ///< N, mean over the last substep, on the handle
    double hand_work = 0;                   ///< J, ∫ F_hand·dx since the start
    double environment_work = 0;            ///< J, the same for the environment
    double kinetic_energy = 0;              ///< J, of the device without the mass of the hand
    double spring_energy = 0;               ///< J, of the structural mode
    bool watchdog_fired = false;            ///< it ended the force during the last interval
  };

  /// 10 s is much longer than any pause that a loop survives, and limits the cost of one `read` to 200 000 substeps,
  /// about 10 ms.
  static constexpr Duration kMaxGap = std::chrono::seconds(10);

  /// Fifty times the delay of a bus; a slower device is not a haptic one. It limits the number of forces in transit.
  static constexpr Duration kMostDelay = std::chrono::milliseconds(100);

  /// Throws std::invalid_argument, naming the field, its value and the expected range.
  explicit SimulatedDevice(Config config);

  const DeviceInfo& info() const noexcept override { return info_; }

  /// Always returns a sample.
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  /// With `joint_friction`, returns the joints of its mechanism at the position returned by `read`.
  Joints joints(const Motion& hand) const noexcept override { return joints_ ? joints_->at(hand) : Joints{}; }

  /// Returns the force after saturation. If a component is not finite, zero is held and returned. Ends torque and grip.
  Vec3 apply(const Vec3& force) noexcept override;

  /// Returns the effort after saturation: the wrench is reduced to `max_force` and `max_torque` by a common factor.
  /// Torque and grip are zero without the corresponding motors. If a component is not finite, all of the effort is
  /// zero.
  Effort apply_all(const Effort& effort) noexcept override;

  void set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept override;

  const Truth& truth() const noexcept { return truth_; }
  const SimulatedRotation* rotation() const noexcept { return rotation_ ? &*rotation_ : nullptr; }
  const SimulatedGripper* gripper() const noexcept { return gripper_ ? &*gripper_ : nullptr; }
  const SimulatedOutputs& outputs() const noexcept { return outputs_; }

 private:
  /// The amplifier over one substep of length h with the time constant τ.
  struct Lag {
    double reached = 1;     ///< 1 − e^(−h/τ)
    double h_over_tau = 0;  ///< h/τ
  };
  /// Kind of Coulomb friction.
  enum class Rub : std::uint8_t { kNone, kHandle, kJoints };
  /// What acts on the handle in addition to the hand.
  enum class Far : std::uint8_t { kNone, kMode, kEnvironment };
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
  /// A mass in a substep, in kg. `resistance` adds h/2 times all coefficients of forces proportional to its velocity.
  struct Side {
    double mass = 0;
    double resistance = 0;
  };

  Vec3 sensed_force() const noexcept;
  std::uint32_t pressed() const noexcept;
  // Not inlined, so that a device without such parts only pays for a branch.
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
  bool turns_or_grips_ = false;  ///< it has a rotation or a gripper
  bool has_more_ = false;        ///< … or button presses
  Substeps take_substeps_;
  DeviceInfo info_;
  std::optional<LocalTime> last_read_;
  Duration lived_{};             ///< time since the first read
  Vec3 command_ = Vec3::Zero();  ///< N, held
  std::optional<ForcesUnderWay> under_way_;
  Vec3 motor_velocity_ = Vec3::Zero();      ///< m/s, ẏ of a structural mode
  std::optional<Vec3> amplifier_force_;     ///< N, lags behind `command_`
  std::optional<Duration> until_watchdog_;  ///< empty: expired, or no watchdog
  double drive_work_ = 0;                   ///< J, work of the hand's spring and damper
  Truth truth_;
};

/// Lower bounds of the friction for all positions and directions: the largest values that a limiter may assume.
Friction least_friction(const SimulatedDevice::Config& config);
/// Lower bounds at `position` (m) for all directions.
Friction least_friction_at(const SimulatedDevice::Config& config, const Vec3& position);

// The overloads of driver.h.
const Driver& driver(const SimulatedDevice::Config& config);
SimulatedDevice::Config stand_in(const SimulatedDevice::Config& config);
std::unique_ptr<Device> make(const SimulatedDevice::Config& config, FromOutside outside);

/// A handle of 0.1 kg without any effects, for a device about which nothing else is known.
SimulatedDevice::Config plain_stand_in(std::string name);

}  // namespace tendon
