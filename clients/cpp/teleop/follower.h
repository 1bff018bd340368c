// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "clients/cpp/force_client.h"

namespace tendon {

/// Pose of the robot's tool, or its target, in the frame of the robot.
struct Pose {
  Vec3 position = Vec3::Zero();       ///< m
  std::optional<Quat> orientation{};  ///< unit quaternion; empty: only the position is controlled
  std::optional<double> grip{};       ///< opening of the gripper, m or rad; empty: no gripper
};

/// Force that the environment exerts on the tool, in the frame of the robot: a table pushes up.
struct ToolContact {
  Vec3 force = Vec3::Zero();           ///< N
  std::optional<Vec3> torque{};        ///< N·m, about the position of the tool
  std::optional<double> stiffness{};   ///< N/m, > 0, of the surface along its normal, if known
  std::optional<Vec3> normal{};        ///< points from the surface to the tool, any length; empty: along the force
  std::optional<double> grip_force{};  ///< N, on the fingers; > 0 opens them
};

enum class Following : std::uint8_t {
  kAlone = 1,     ///< no state has arrived
  kCoupled = 2,   ///< the robot waits until the operator engages
  kEngaged = 4,   ///< the robot follows the hand
  kClutched = 5,  ///< the hand moves freely and the robot holds its pose
  kLost = 6,      ///< states stopped; the operator must engage again
};

/// Teleoperation of a robot by the hand at a Tendon server, with force feedback. Implements the position mapping, the
/// clutch, and the reaction to loss of connection. This class does not use clocks, threads or sockets.
///
///     Follower follow({.scale = 0.5, .clutch_button = 1});
///     const auto move = [&](const std::optional<Pose>& target) { target ? robot.go_to(*target) : robot.hold(); };
///     options.on_silence = [&](LocalTime now) { move(follow.silence(now)); };
///     return run(options, [&](const DeviceState& hand) {
///       move(follow.target(hand, robot.pose(), read_clock()));
///       return follow.touch(robot.contact());
///     });
///
/// With positions p, orientations q, the hand l (leader), the tool f (follower), and 0 for the values when engaging:
///
///     p_f = p_f0 + s_x R M (p_l − p_l0)        q_f = (R q_l q_l0⁻¹ R⁻¹) q_f0        M selects the coupled axes
///     F_l = s_f M Rᵀ F_f                       τ_l = s_f / s_x Rᵀ τ_f               K_l = s_f s_x M Rᵀ K_f R M
///
/// so the power at the hand is s_f / s_x times the power at the tool. The robot does not move until the operator
/// engages with the button or with engage(). The offset is defined by the poses at that time, so that the robot does
/// not move when it is engaged or when the clutch is released. The reaction to missing states depends on the age of the
/// newest state beyond the smoothed delay, where v is three periods, at least 20 ms:
///
///     v             the target stops
///     v + 20 ms     no target: the robot must hold its pose
///     v + 250 ms    lost: new states couple again, but the operator must engage again
///
/// Absolute times of the two clocks are never compared. The coupling ends if the device has a fault or is disarmed, or
/// if a pose is not finite. There are equivalent implementations in Python and TypeScript;
/// tests/clients/follower_cases.json checks all three.
///
/// Thread-safe: no. Realtime-safe: yes, except the constructor and set_scale when they throw.
class Follower {
 public:
  enum class EngageBy : std::uint8_t {
    kButton,  ///< pressing and releasing the clutch button; with `toggle`, pressing it
    kCall,
  };
  struct Config {
    double scale = 1;                              ///< s_x, motion of the follower / motion of the leader, 0.01 … 100
    double force_scale = 1;                        ///< s_f, force on the leader / force on the follower, 0.01 … 100
    Quat rotation{};                               ///< R, from the device base frame to the robot frame; norm 1 ± 1e-3
    std::string axes = "xyz";                      ///< coupled axes of the device; the others move freely without force
    std::optional<std::uint32_t> clutch_button{};  ///< 0 … 31, clutched while pressed; empty: no button
    bool toggle = false;                           ///< each press switches between engaged and clutched
    EngageBy engage_by = EngageBy::kButton;
    double speed = 0.25;      ///< m/s, 0.001 … 10, maximum speed of the target
    double spin = 2;          ///< rad/s, 0.01 … 100, maximum angular speed of the target
    double ramp_s = 0.3;      ///< 0 … 10, duration of the force ramp after engaging
    double grip_ratio = 1;    ///< opening of the robot's gripper / opening of the hand's gripper, 0.001 … 1000
    double grip_speed = 0.1;  ///< m/s or rad/s, 0.001 … 100, maximum speed of the gripper
    double rate_hz = 500;     ///< rate at which target() is called, 1 … 100000
  };

  explicit Follower(const Config& config);  ///< throws std::invalid_argument "FIELD = VALUE: expected …"

  Following phase() const noexcept { return phase_; }
  std::string_view words() const noexcept { return words_; }  ///< newest message for the operator; empty: none

  /// Engages at the next state. Returns false and does nothing unless phase() is kCoupled.
  bool engage() noexcept { return asked_ = phase_ == Following::kCoupled; }
  void disengage() noexcept;  ///< stops the robot until the operator engages again
  /// Returns false without effect while the robot follows. Throws std::invalid_argument if a scale is out of bounds.
  bool set_scale(double scale, double force_scale);

  /// Returns the next target of the tool, which moves at most at `speed`; empty: the robot must hold its pose. `pose`
  /// is the current pose of the tool. `now` is the arrival time of the state, from a monotonic clock.
  std::optional<Pose> target(const DeviceState& hand, const Pose& pose, LocalTime now) noexcept;
  /// Must be called every few milliseconds while no state arrives. Returns the last target at first, then empty.
  std::optional<Pose> silence(LocalTime now) noexcept;

  /// Returns the force on the hand for a contact of the tool; zero while the robot does not follow. An empty `contact`
  /// gives a Touch that is not sent (Touch::unknown), because a zero force would look like a measurement.
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
  bool held_ = true;  ///< button in the newest state. Initially true, so that a press counts only after a release
  std::uint64_t tick_ = 0;
  PeerTime sampled_{};
  struct Base {  // arrival and sampling time of the first state; delays are relative to it
    LocalTime came;
    PeerTime sampled;
  };
  std::optional<Base> base_{};
  double usual_ns_ = 0;  ///< smoothed delay, relative to that of the first state
  LocalTime now_{};
  LocalTime gain_from_{};
  bool waits_ = false;  ///< target() has returned empty since the last target
  Vec3 hand0_ = Vec3::Zero();
  std::optional<Quat> turned0_{};
  Pose pose0_{};
  Pose target_{};
};

}  // namespace tendon
