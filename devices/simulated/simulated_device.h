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

/// A haptic device that exists only as its equation of motion, with an operator's hand on its handle:
///
///     m dv/dt = F_device + F_hand − b v − f_c sgn(v),      sgn(v) = v/|v|;  any |sgn| ≤ 1 at v = 0
///
/// Forces in N on the handle: F_device is the force of the device on the hand, F_hand the force of the hand on the
/// device. Friction is isotropic, or that of the joints of a mechanism (JointFriction). The device has the effects that
/// its configuration lists, and no others. An effect that is left out costs an empty optional, and nothing in a
/// substep: each combination of effects has a loop of its own.
///
/// **A structural mode** parts the mass: motors, friction and encoder are at one end of a spring K and damper C, handle
/// and hand at the other. With the motor side at y = x + e and of mass m − m_h,
///
///     (m − m_h) dẏ/dt = F_device − b ẏ − f_c sgn(ẏ) − K e − C ė,      m_h dv/dt = F_hand + K e + C ė
///
/// When nobody holds the handle, the mode rings at ω² = K (1/(m − m_h) + 1/m_h), ζ = C ω/(2 K); with the motor side
/// held still, at ω² = K/m_h. Resonances of the mechanism narrow the impedances that a device can show (Gil et al.,
/// IROS 2010; Çavuşoğlu, Feygin and Tendick, Presence 11(6), 2002). Here the hand never feels a stiffness above K. The
/// most damping that can be rendered falls from about 2 m/T to 2 (m − m_h)/T, and further the nearer the mode is to the
/// loop's rate. The stiffest stable sampled spring stays as stiff, because encoder and motors are on one side.
///
/// **Time.** The first `read` sets the instant 0. Each later one integrates up to its `now`, with the force that the
/// last `apply` left. Encoder and force change at the same instant, that of the last `read`. Time that goes backwards
/// moves nothing. Of a gap longer than kMaxGap only that much is integrated; the rest is skipped.
///
/// **Transport delay.** With `sample_delay` d_s, `read(now)` gives the sample taken at now − d_s, and `at` says so. The
/// integration, and with it `truth()`, ends at that instant: read now − d_s for now above. With `force_delay` d_f, the
/// force that `apply` returns reaches the motors that much later; before the first one arrives there is no force. Both
/// are exact to the nanosecond, whatever the period. A sample shows the first effect of a force d_s + d_f after it was
/// applied. The device's watchdog counts the forces that reach it.
///
/// **A handle that turns and grips** has a `rotation` and a `gripper` (SimulatedRotation, SimulatedGripper), which live
/// through the same substeps and share nothing else with the position: no mass, no friction, no amplifier. What is said
/// here about delays and the watchdog holds for torque and grip too. Of a wrench that is too large, force and torque
/// are shortened by one share, so it keeps its direction; the grip is clamped by itself.
///
/// **Surroundings** (SimulatedEnvironment) are walls and a medium at the handle: another force on the right, and for the
/// force sensor a part of what holds the handle. They are taken at the middle of a substep in time and place.
///
/// **Integration.** Substeps of equal length h ≤ max_substep; each is one implicit midpoint rule with
/// set-valued friction (Moreau's time stepping with θ = ½). With v̄ = (v₀ + v₁)/2 it satisfies, exactly,
///
///     m (v₁ − v₀)/h = F_device + F_hand − b v̄ − f_c sgn(v̄),      x₁ = x₀ + h v̄
///
/// where F_hand is taken at the midpoint in time, position and velocity. It is solved in closed form: the
/// half-step momentum p is shrunk by the friction impulse, then divided by mass and damping,
///
///     v̄ = (1 − h f_c/(2|p|))₊ p / (m + (h/2)(b + c + k h/2)),      p = m v₀ + (h/2)(F_device + drive)
///
/// When the velocity reaches or crosses zero and friction can hold the pushing force, the device rests: v₁ = 0. So it
/// sticks exactly, without a velocity threshold, in any direction. Reason for this rule: it is stable for any hand, and
/// it neither makes nor hides energy, because m (v₁ − v₀)·v̄ is exactly the change of kinetic energy. A damped
/// integrator would make every limiter look better than it is:
/// semi-implicit Euler at 50 µs holds springs stable that are 5 % too stiff for the real device. With a structural mode
/// its spring force is that of the mean deflection, and both velocities come of one linear equation; the mode rings at
/// (2/h) atan(ω h/2), 0.03 % low at 200 Hz. Consequently, as long as the force held is the force returned (no
/// transport delay, no amplifier lag, no watchdog ran out), with the E of EnergyLedger fed with the true position of
/// what the encoder sees and with `least_friction`, up to rounding,
///
///     work of hand and surroundings + stored energy at the start ≥ E + stored energy now
///
/// where the kinetic energy of the device is stored, and that of the spring between its masses. Under transport delay
/// it holds with the forces that have reached the motors, and not with those returned: a delayed spring does give out
/// energy.
class SimulatedDevice final : public Device {
 public:
  struct Config {
    std::string name = "simulated";
    double mass = 0;                     ///< kg, apparent mass at the handle, > 0
    std::optional<Vec3> start_position;  ///< m; left out: where the hand's motion starts, or the origin
    Vec3 start_velocity = Vec3::Zero();  ///< m/s

    /// Effects: listed (> 0) or not there.
    std::optional<double> viscous_friction;  ///< b, N·s/m
    std::optional<double> coulomb_friction;  ///< f_c, N
    /// Friction in the joints, in place of `coulomb_friction`. The energy balance holds with it.
    std::optional<JointFriction::Config> joint_friction;
    /// The mass that the hand holds is on a spring: see above. The energy balance holds with it.
    struct StructuralMode {
      double handle_mass = 0;  ///< m_h, kg, of `mass`; > 0 and below it
      double stiffness = 0;    ///< K, N/m, > 0
      double damping = 0;      ///< C, N·s/m, ≥ 0
    };
    std::optional<StructuralMode> structural_mode;
    /// m, one encoder count per axis. The sample is the centre of the count, so the truth is never
    /// more than half a count away; the origin is a centre.
    std::optional<double> encoder_step;
    std::optional<double> max_force;  ///< N, norm of the force vector; its direction is kept
    /// Hz, −3 dB, first order. The motors follow the force that `apply` returned with this lag.
    std::optional<double> amplifier_bandwidth;
    /// A sensor between handle and hand, as devices of admittance type have, and robots at the wrist. It measures the
    /// mean force of hand and surroundings over the last substep, without noise. The energy balance holds with it.
    struct ForceSensor {
      std::optional<double> resolution;  ///< N, one count per axis; the sample is the centre of the count
    };
    std::optional<ForceSensor> force_sensor;
    std::optional<Duration> watchdog;  ///< without an `apply` for so long the force is zero until the next one
    /// d_s and d_f, each up to kMostDelay. USB and a device's own loop take 1 to 2 ms. They break the energy balance.
    std::optional<Duration> sample_delay;
    std::optional<Duration> force_delay;

    /// Walls and a medium at the handle; not beside a structural mode. The energy balance holds with it.
    std::optional<SimulatedEnvironment::Config> environment{};

    std::optional<OperatorHand::Config> hand;
    /// So long after the first `read` the hand lets go of the handle, for good, and takes its mass with it.
    std::optional<Duration> lets_go_after{};
    std::optional<Duration> button_after;  ///< so long after the first `read` the hand presses button 0, and holds it
    /// The hand presses a button.
    struct Press {
      std::uint32_t button = 0;  ///< its bit in PositionSample::buttons, below 32
      Duration from{};           ///< since the first `read`, ≥ 0
      Duration length{};         ///< > 0
    };
    std::vector<Press> presses{};

    /// The handle also turns, and every sample has an orientation. The energy balance holds for −τ·ω besides.
    std::optional<SimulatedRotation::Config> rotation{};
    /// The handle has a gripper. Its energy balance is one of its own.
    std::optional<SimulatedGripper::Config> gripper{};
    std::vector<OutputDescription> outputs{};  ///< lamps and vibration, at most kMostOutputs

    /// > 0. 50 µs is 20 substeps per haptic period at 1 kHz. It puts the stiffness at which a sampled spring loses
    /// stability (75 g, 1 kHz) within 1.4e-6 of the exact one at 0.26 N·s/m, and 2.8e-5 at 5. The error goes with the
    /// square of this, the cost with its inverse; the balance of energy is exact for any.
    Duration max_substep = std::chrono::microseconds(50);
  };

  /// The true state, for tests; no production code may read it.
  struct Truth {
    Vec3 position = Vec3::Zero();      ///< m, of the handle
    Vec3 velocity = Vec3::Zero();      ///< m/s, of the handle
    Vec3 deflection = Vec3::Zero();    ///< m, e: the encoder is at position + deflection; 0 without a structural mode
    Vec3 device_force = Vec3::Zero();  ///< N, mean over the last substep, on the handle
    Vec3 hand_force = Vec3::Zero();    ///< N, mean over the last substep, on the handle
    Vec3 environment_force = Vec3::Zero();  ///< N, mean over the last substep, on the handle
    double hand_work = 0;                   ///< J, ∫ F_hand·dx since the start
    double environment_work = 0;            ///< J, the same of the surroundings
    double kinetic_energy = 0;              ///< J, of the device alone (the hand's mass is the hand's)
    double spring_energy = 0;               ///< J, of the structural mode
    bool watchdog_fired = false;            ///< it took the force away during the last interval
  };

  /// 10 s is far beyond any pause that a loop survives, and bounds what one `read` may cost (200 000
  /// substeps, some 10 ms).
  static constexpr Duration kMaxGap = std::chrono::seconds(10);

  /// Fifty times what a bus takes; a slower device is no haptic one. It bounds how many forces are under way.
  static constexpr Duration kMostDelay = std::chrono::milliseconds(100);

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit SimulatedDevice(Config config);

  const DeviceInfo& info() const noexcept override { return info_; }

  /// Always answers.
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  /// Of a device with `joint_friction`: those of its mechanism, at the position that `read` gave.
  Joints joints(const Motion& hand) const noexcept override { return joints_ ? joints_->at(hand) : Joints{}; }

  /// Returns the force after saturation. A force with a component that is not finite is no force:
  /// zero is held and returned. It ends torque and grip.
  Vec3 apply(const Vec3& force) noexcept override;

  /// Returns the effort after saturation: its wrench is shortened to `max_force` and `max_torque` by one share. A
  /// device without motors that turn gives no torque, and one without a motor in its gripper no grip. An effort with a
  /// component that is not finite is none.
  Effort apply_all(const Effort& effort) noexcept override;

  void set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept override;

  const Truth& truth() const noexcept { return truth_; }
  const SimulatedRotation* rotation() const noexcept { return rotation_ ? &*rotation_ : nullptr; }
  const SimulatedGripper* gripper() const noexcept { return gripper_ ? &*gripper_ : nullptr; }
  const SimulatedOutputs& outputs() const noexcept { return outputs_; }

 private:
  /// Of the amplifier, over one substep of length h with the time constant τ.
  struct Lag {
    double reached = 1;     ///< 1 − e^(−h/τ)
    double h_over_tau = 0;  ///< h/τ
  };
  /// What Coulomb friction there is.
  enum class Rub : std::uint8_t { kNone, kHandle, kJoints };
  /// What is at the handle besides the hand.
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
  /// A mass in a substep, kg, and what resists its velocity: the mass, and h/2 of all that is in proportion to it.
  struct Side {
    double mass = 0;
    double resistance = 0;
  };

  Vec3 sensed_force() const noexcept;
  std::uint32_t pressed() const noexcept;
  // Kept out of line, so that a device without such parts pays a branch for them.
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
  bool turns_or_grips_ = false;  ///< it has one of these two
  bool has_more_ = false;        ///< … or presses
  Substeps take_substeps_;
  DeviceInfo info_;
  std::optional<LocalTime> last_read_;
  Duration lived_{};             ///< since the first read
  Vec3 command_ = Vec3::Zero();  ///< N, held
  std::optional<ForcesUnderWay> under_way_;
  Vec3 motor_velocity_ = Vec3::Zero();      ///< m/s, ẏ of a structural mode
  std::optional<Vec3> amplifier_force_;     ///< N, lags behind `command_`
  std::optional<Duration> until_watchdog_;  ///< empty: it has run out, or there is none
  double drive_work_ = 0;                   ///< J, of the hand's spring and damper
  Truth truth_;
};

/// The friction that a device with this configuration has at the least, anywhere and in any direction: what a limiter
/// may at most count on.
Friction least_friction(const SimulatedDevice::Config& config);
/// … at `position` (m) in any direction.
Friction least_friction_at(const SimulatedDevice::Config& config, const Vec3& position);

// The row of this driver: see driver.h.
const Driver& driver(const SimulatedDevice::Config& config);
SimulatedDevice::Config stand_in(const SimulatedDevice::Config& config);
std::unique_ptr<Device> make(const SimulatedDevice::Config& config, FromOutside outside);

/// A handle of 0.1 kg without any effect: stands in for a device of which nothing else is known.
SimulatedDevice::Config plain_stand_in(std::string name);

}  // namespace tendon
