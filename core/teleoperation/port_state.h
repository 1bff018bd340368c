// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/motion.h"
#include "core/base/time.h"

namespace tendon {

/// The phase of a coupling. There is only a force in `kEngaged`, in the fade after it, and if a robot holds still.
enum class PortPhase : std::uint8_t {
  kAlone = 1,  ///< no peer
  kCoupled,    ///< no force; states are received, and the operator can engage
  kAligning,   ///< absolute map: the leader is moved to the position of the follower
  kEngaged,    ///< the law computes the force
  kClutched,   ///< the leader moves freely and the follower holds its position
  kLost,       ///< the peer fell silent during an act; requires a new act
  kFault,      ///< no force, because the device is not armed or has a fault
};

/// Returns the name and what the phase waits for, such as "coupled: waiting for the leader to engage".
std::string_view to_string(PortPhase phase) noexcept;

enum class PortRole : std::uint8_t { kLeader, kFollower };

/// The parameters of the method rate, in the scale of the leader. A spring pulls the handle of the leader to its
/// center, and its displacement sets the velocity of the follower.
struct RateControl {
  double dead_zone = 0;  ///< m, ≥ 0; the follower does not move if the displacement is smaller
  double gain = 0;       ///< 1/s, > 0; velocity per displacement beyond the dead zone
  double max_speed = 0;  ///< m/s, > 0

  bool operator==(const RateControl&) const = default;
};

/// A flat elastic surface found by the tool of the sender: SurfaceModel in its displacements u.
struct PortSurface {
  Vec3 normal = Vec3::UnitX();  ///< out of the surface, norm 1 ± 0.001
  double offset = 0;            ///< m, the surface is at normal·u = offset
  double stiffness = 0;         ///< N/m, ≥ 0, or 0 if there is no surface
};

/// The rotation of a handle since its offset was set.
struct PortTurn {
  Quat turn{};                           ///< in the axes of the sender's base frame; norm 1 ± 0.001
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s; zero if `turn` is constant
  Vec3 torque = Vec3::Zero();            ///< N·m, applied by the device to the hand
};

/// A gripper at its fingers. It is a separate port with its own account.
struct PortGrip {
  double opening = 0;   ///< m; for a leader, the requested opening (GripCoupling)
  double velocity = 0;  ///< m/s
  double force = 0;     ///< N, applied by the device; opens the fingers if positive
  double account = 0;   ///< J; this and the following values are as in PortState
  double need = 0;
  double given = 0;
  double taken = 0;
};

/// The state that one port of a coupling sends to the other in each period. States may be rare, late, duplicated or
/// reordered: the highest `sequence` in the highest `epoch` is used. All vectors use the base frame and the scale of
/// the SENDER, and must be mapped by the receiver (PoseMap).
struct PortState {
  static constexpr Duration kMostRoundTrip = std::chrono::seconds(10);

  std::uint64_t epoch = 0;          ///< epoch of the sender, > 0; increases at each restart (EnergyTank)
  std::uint64_t sequence = 0;       ///< period of the sender in this epoch: 1, 2, …
  std::uint64_t answers_epoch = 0;  ///< epoch of the receiver for `answers`, `given` and `taken`, or 0 if there is none
  std::uint64_t answers = 0;        ///< sequence of the receiver's newest state that was used, or 0 if there is none
  Duration time{};                  ///< time of the sender, ± 2⁶⁰ ns; only used for differences
  Duration round_trip{};            ///< as measured by the sender, or 0; ≤ kMostRoundTrip
  PortPhase phase = PortPhase::kAlone;
  std::uint64_t engagement = 0;          ///< number of the leader's act that the phase belongs to, or 0 if none
  std::uint32_t buttons = 0;             ///< bit i is set if button i is pressed
  Vec3 position = Vec3::Zero();          ///< m, u: relative to the offset of the sender
  Vec3 velocity = Vec3::Zero();          ///< m/s, of u; zero if u is constant
  Vec3 force = Vec3::Zero();             ///< N, applied by the device to the hand
  std::optional<Vec3> contact_force{};   ///< N, measured on the tool; empty if not measured
  double account = 0;                    ///< J, EnergyTankMessage::account
  double need = 0;                       ///< J, EnergyTankMessage::need, or 0 if there is no tank
  double given = 0;                      ///< J, EnergyTankMessage::given
  double taken = 0;                      ///< J, EnergyTankMessage::taken
  std::optional<PortSurface> surface{};  ///< last surface that was touched by the tool, if any
  Vec3 wave_integral = Vec3::Zero();     ///< √W·s, WaveMessage::integral
  double wave_energy = 0;                ///< J, WaveMessage::energy; 0 … kMostTotal of EnergyTankMessage
  std::optional<PortTurn> turn{};        ///< empty if orientations are not coupled
  std::optional<PortGrip> grip{};        ///< empty if grippers are not coupled
  double energy_in = 0;                  ///< J, for passivity: total received in this epoch; bounds of wave_energy
  std::optional<double> share{};         ///< 0 … 1, share of this leader, from a follower; empty for one leader
  double position_scale = 0;  ///< 0.01 … 100, from a leader, for this and later states; 0 if it is that of the scene
  double force_scale = 0;
};

/// Returns true if all values are finite and within their bounds (see above and tendon.proto).
bool is_sound(const PortState& state) noexcept;
bool is_sound(const PortSurface& surface) noexcept;
bool is_sound(const PortTurn& turn) noexcept;
bool is_sound(const PortGrip& grip) noexcept;

}  // namespace tendon
