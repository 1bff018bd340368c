// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "clients/cpp/force_client.h"

namespace tendon {

/// Of a robot's tool, in the robot's frame; of a target, what the tool is to reach.
struct Pose {
  Vec3 position = Vec3::Zero();       ///< m
  std::optional<Quat> orientation{};  ///< unit quaternion; empty: position alone is followed
  std::optional<double> grip{};       ///< opening of the gripper, m or rad; empty: no gripper
};

/// What the surroundings exert on the tool, in the robot's frame: a table below pushes up.
struct ToolContact {
  Vec3 force = Vec3::Zero();           ///< N
  std::optional<Vec3> torque{};        ///< N·m, about the tool's position
  std::optional<double> stiffness{};   ///< N/m, > 0, of the surface along its normal, where it is known
  std::optional<Vec3> normal{};        ///< out of the body, to the tool, of any length; empty: along the force
  std::optional<double> grip_force{};  ///< N, on the fingers; > 0 opens them
};

enum class Following : std::uint8_t {
  kAlone = 1,     ///< no state has come
  kCoupled = 2,   ///< states come; the robot stands until somebody engages
  kEngaged = 4,   ///< the robot follows
  kClutched = 5,  ///< the hand moves freely, the robot holds its place
  kLost = 6,      ///< silence; never engaged again without the act
};

/// A robot follows the hand at a Tendon server, and the hand feels what the robot touches: map, clutch, loss ladder and
/// signs. It has no clock, thread or socket.
///
///     Follower follow({.scale = 0.5, .clutch_button = 1});
///     const auto move = [&](const std::optional<Pose>& target) { target ? robot.go_to(*target) : robot.hold(); };
///     options.on_silence = [&](LocalTime now) { move(follow.silence(now)); };
///     return run(options, [&](const DeviceState& hand) {
///       move(follow.target(hand, robot.pose(), read_clock()));
///       return follow.touch(robot.contact());
///     });
///
/// Position p, orientation q; l is the hand (the leader), f the tool (the follower), 0 the moment of engaging:
///
///     p_f = p_f0 + s_x R M (p_l − p_l0)        q_f = (R q_l q_l0⁻¹ R⁻¹) q_f0        M leaves out axes not coupled
///     F_l = s_f M Rᵀ F_f                       τ_l = s_f / s_x Rᵀ τ_f               K_l = s_f s_x M Rᵀ K_f R M
///
/// so what the hand pays in power is s_f / s_x of what the tool gives. Nothing moves before the act of engaging, by
/// the button or engage(). The pose of that moment is the offset: neither engaging nor releasing the clutch moves the
/// robot. The age of the newest state beyond the smoothed delay decides when states stop, v being three periods and at
/// least 20 ms:
///
///     v             the target stays where it is
///     v + 20 ms     no target: the robot holds its place
///     v + 250 ms    lost: a new state couples again, only a new act engages
///
/// The two clocks are never compared. A fault or a disarmed device disengages, as does a pose that is not finite.
/// Written also in Python and TypeScript; tests/clients/follower_cases.json holds all three to the same numbers.
///
/// Thread-safe: no. Realtime-safe: yes, except the constructor and set_scale when they throw.
class Follower {
 public:
  enum class EngageBy : std::uint8_t {
    kButton,  ///< of the clutch, pressed and released; with `toggle`, pressed
    kCall,    ///< engage()
  };
  struct Config {
    double scale = 1;          ///< s_x, follower / leader, 0.01 … 100
    double force_scale = 1;    ///< s_f, leader / follower, 0.01 … 100
    Quat rotation{};           ///< R, turns the device's base frame into the robot's; length 1 ± 1e-3
    std::string axes = "xyz";  ///< of the device, coupled; the others are free and feel nothing
    std::optional<std::uint32_t> clutch_button{};  ///< 0 … 31; held: clutched. Empty: engage() and disengage() alone
    bool toggle = false;                           ///< each press of the button changes between engaged and clutched
    EngageBy engage_by = EngageBy::kButton;
    double speed = 0.25;      ///< m/s, 0.001 … 10: no target moves faster
    double spin = 2;          ///< rad/s, 0.01 … 100: nor turns faster
    double ramp_s = 0.3;      ///< 0 … 10, in which the force grows from 0 to all of it after engaging
    double grip_ratio = 1;    ///< opening of the robot's gripper / that of the hand's, 0.001 … 1000
    double grip_speed = 0.1;  ///< m/s or rad/s, 0.001 … 100, of the gripper
    double rate_hz = 500;     ///< states per second that target() is given, 1 … 100000
  };

  /// Throws std::invalid_argument "FIELD = VALUE: expected …" when a value of `config` is impossible.
  explicit Follower(const Config& config);

  Following phase() const noexcept { return phase_; }
  /// The newest sentence for the operator; empty: none.
  std::string_view words() const noexcept { return words_; }

  /// The act, for the next state. False, and nothing happens, unless states come and the robot does not follow.
  bool engage() noexcept { return asked_ = phase_ == Following::kCoupled; }
  /// The robot stands until the next act.
  void disengage() noexcept;
  /// False, and nothing changes, while the robot follows. Throws std::invalid_argument when a scale is out of its
  /// bounds.
  bool set_scale(double scale, double force_scale);

  /// Where the tool is to go, no faster than `speed`; empty: hold. `pose`: where the tool is. `now`: when the state
  /// came, of a clock that does not go back.
  std::optional<Pose> target(const DeviceState& hand, const Pose& pose, LocalTime now) noexcept;
  /// The same while no state comes, every few milliseconds: the frozen target, then none.
  std::optional<Pose> silence(LocalTime now) noexcept;

  /// What the hand feels of the tool's contact; nothing while the robot does not follow. Empty `contact`: a Touch that
  /// is not sent (Touch::unknown), because a zero would look measured.
  Touch touch(const std::optional<ToolContact>& contact) noexcept;

 private:
  double advance(LocalTime now) noexcept;
  Duration age() const noexcept;
  Duration take(const DeviceState& hand) noexcept;
  void lose() noexcept;
  void act(const DeviceState& hand, const Pose& pose, bool fresh) noexcept;
  void begin(const DeviceState& hand, const Pose& pose) noexcept;
  void approach(const DeviceState& hand, double seconds) noexcept;
  Vec3 masked(const Vec3& v) const noexcept { return mask_.cwiseProduct(v); }

  Config config_;
  double scale_;
  double force_scale_;
  Quat turn_;
  Vec3 mask_;
  Duration late_;  ///< v
  Following phase_ = Following::kAlone;
  std::string_view words_{};
  bool asked_ = false;
  bool held_ = true;  ///< the button at the newest state: only one that was seen free can be pressed
  std::uint64_t tick_ = 0;
  PeerTime sampled_{};
  /// Of the state that began the link, when it came and when it was sampled: the others are counted from it.
  struct Base {
    LocalTime came;
    PeerTime sampled;
  };
  std::optional<Base> base_{};
  double usual_ns_ = 0;  ///< smoothed delay, less that of the first state
  LocalTime now_{};
  LocalTime gain_from_{};
  bool waits_ = false;  ///< the robot was told to hold since the newest target
  Vec3 hand0_ = Vec3::Zero();
  std::optional<Quat> turned0_{};
  Pose pose0_{};
  Pose target_{};
};

}  // namespace tendon
