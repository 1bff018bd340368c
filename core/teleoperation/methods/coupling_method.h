// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace tendon {

// The catalogue of the methods. To add a method, add an enumerator and a row here. Scenes, messages, `tendon-lab` and
// the tests find it through kCouplingMethods and info().

enum class CouplingMethod : std::uint8_t {
  kPositionPosition = 1,  ///< uses springs and dampers at both ends, with an energy tank (PositionPosition)
  kPositionForce,         ///< spring at the follower; the leader feels the measured contact force
  kWaves,                 ///< wave variables with playout (WavePort)
  kSurface,               ///< similar to position-force, but uses a model of the surface at the leader
  kPassivity,             ///< velocity to the follower, force to the leader, with passivity control (PassivityLeader)
  kSetPosition,           ///< springs to delayed positions, stretched only as far as the account pays
  kRate,                  ///< the position of the leader sets the velocity of the follower
};

struct CouplingMethodInfo {
  CouplingMethod method;
  std::string_view name;       ///< in scenes and error messages
  std::string_view what;       ///< one line
  bool has_places = false;     ///< positions of leader and follower correspond (CouplingAbsolute)
  bool has_springs = false;    ///< the springs at both ends adapt to the delay
  bool has_velocity = true;    ///< uses the velocity of the peer
  bool is_felt = true;         ///< the leader feels the contact of the follower
  bool keeps_scales = false;   ///< the scales cannot be changed, because the totals of the method depend on them
  bool can_be_shared = false;  ///< works with more than one leader
  bool needs_tank = false;     ///< a follower with a limiter can only move when the leader pays for it (EnergyTank)
  std::string_view needs_damping{};  ///< why own_damping must be above 0; empty if it can be 0
};

namespace coupling_methods {

inline constexpr auto kRows = std::to_array<CouplingMethodInfo>({
    {.method = CouplingMethod::kPositionPosition,
     .name = "position-position",
     .what = "a spring between the handles",
     .has_places = true,
     .has_springs = true,
     .can_be_shared = true,
     .needs_tank = true},
    {.method = CouplingMethod::kPositionForce,
     .name = "position-force",
     .what = "the leader feels the contact force that is measured at the follower",
     .has_places = true,
     .can_be_shared = true},
    {.method = CouplingMethod::kWaves,
     .name = "waves",
     .what = "wave variables, which are stable for long delays",
     .keeps_scales = true,
     .needs_damping = "it is the wave impedance"},
    {.method = CouplingMethod::kSurface,
     .name = "surface",
     .what = "the leader feels a local model of the surface that the follower has found",
     .has_places = true},
    {.method = CouplingMethod::kPassivity,
     .name = "passivity",
     .what = "the leader feels the motor force of the follower, and a passivity controller at each end limits the "
             "energy",
     .keeps_scales = true,
     .needs_tank = true,
     .needs_damping = "nothing else absorbs energy, so no motion could start"},
    {.method = CouplingMethod::kSetPosition,
     .name = "set-position",
     .what = "springs to infrequent set positions, which are stretched as far as the energy account allows",
     .has_places = true,
     .has_springs = true,
     .has_velocity = false,
     .needs_tank = true},
    {.method = CouplingMethod::kRate,
     .name = "rate",
     .what = "the displacement of the leader sets the speed of the follower",
     .is_felt = false},
});

}  // namespace coupling_methods

inline constexpr auto kCouplingMethods = [] {
  std::array<CouplingMethod, coupling_methods::kRows.size()> all{};
  std::ranges::transform(coupling_methods::kRows, all.begin(), &CouplingMethodInfo::method);
  return all;
}();
static_assert(
    [] {
      for (std::size_t i = 0; i < kCouplingMethods.size(); ++i) {
        if (static_cast<std::size_t>(kCouplingMethods[i]) != i + 1) return false;
      }
      return true;
    }(),
    "row i of the catalogue is enumerator i + 1 of CouplingMethod");

constexpr const CouplingMethodInfo& info(CouplingMethod method) noexcept {
  return coupling_methods::kRows[static_cast<std::size_t>(method) - 1];
}

constexpr std::string_view to_string(CouplingMethod method) noexcept { return info(method).name; }

}  // namespace tendon
