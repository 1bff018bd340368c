// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/plug/view.h"
#include "protocol/messages.h"

/// The messages of Haply's Inverse service, version 3.5, as values: its documentation, pages "WebSocket Protocol",
/// "Simulation Channel" and "Basis Permutation"; Isaac Lab's device class for what clients read. SI units. Numbers
/// without a unit in their name are as the service has them: m, m/s, N on the hand, quaternions w x y z.
///
/// In, everything optional, what is not named here is ignored and counted:
///
///     {"session": {"configure": {"basis": {"permutation": "XZY"}}, "force_render_full_state": {}},
///      "inverse3": [{"device_id": "8C4A51F0",
///                    "configure": {"basis": {"permutation": "XZY"}},
///                    "commands": {"set_cursor_force": {"vector": {"x": 0, "y": 0, "z": 1.5}},   // or "values"
///                                 "probe_position": {},
///                                 "tendon": {"torque_nm": {"x": 0, "y": 0, "z": 0.01}, "grip_force_n": 0.5}}}]}
///
/// Out, for each device; "session_id" and each "config" are in the first message, and in one that was asked for by
/// "force_render_full_state":
///
///     {"session_id": 3,
///      "inverse3": [{"device_id": "8C4A51F0",
///                    "config": {"type": "inverse3", "handedness": "right", "preset": "defaults",
///                               "basis": {"permutation": "XYZ"}},
///                    "state": {"cursor_position": {x, y, z}, "cursor_velocity": {…}, "current_cursor_force": {…},
///                              "control_domain": "cartesian", "control_mode": "idle" or "force_control"},
///                    "status": {"ready": true, "in_use": false}}],
///      "wireless_verse_grip": [{"device_id": "0D17B3C2", "config": {"type": "wireless_verse_grip"},
///                    "state": {"orientation": {w, x, y, z}, "buttons": {"a", "b", "c", "button_0" … "button_3"}},
///                    "status": {"ready": true}}],
///      "tendon": {"refused": ["…"],
///                 "devices": [{"device_id", "name", "connected", "tick", "state_age_ms", "reasons": "energy, slew",
///                              "energy_j", "permitted_force_n" (null: no bound), "force_age_ms",
///                              "angular_velocity_radps" {…}, "torque_nm" {…}, "grip_rad", "grip_force_n"}]}}
///
/// A device whose server does not answer has no "state", "ready" is false, and so is "connected". Those of the last
/// line that a device does not measure are absent.
///
/// Thread-safe: yes (no state). Realtime-safe: no.
namespace tendon::plug {

/// Axes of the client in those of the service (x right, y forward, z up), "X-ZY": the client's y is the service's −z.
/// X, Y and Z once each, with − or + before it or not. Rows of the matrix are the client's axes: v_client = B v_service.
/// Empty for any other text. 48 exist; 24 make a left-handed frame.
std::optional<Mat3> basis_of(std::string_view permutation);

/// The frame of a client: the service's, turned by B.
Frame inverse_frame(const Mat3& basis);

/// What a message says about one device.
struct DeviceWish {
  std::string device_id;
  std::optional<std::string> permutation;
  /// A force command was there: the force in the client's frame, N, on the hand; and our own words, N·m and N.
  std::optional<Vec3> force;
  std::optional<Vec3> torque;
  std::optional<double> grip_force;
};

struct Wish {
  bool read = false;                       ///< else it was no message: `refused` says why, and nothing was taken
  std::optional<std::string> permutation;  ///< of the session
  bool full_state = false;
  std::vector<DeviceWish> devices;
  std::vector<std::string> refused;  ///< what of it was not taken, in sentences; at most 8
  std::uint64_t ignored = 0;         ///< commands that mean nothing here
};

inline constexpr std::size_t kLongestMessage = 64 * 1024;  ///< bytes: 16 devices with every command take 6 kB
inline constexpr int kDeepest = 16;                        ///< nested objects and arrays: a message has 5
inline constexpr std::size_t kMostRefusals = 8;            ///< sentences in one reply

/// Reads a message. Bad input is never an exception: too long, too deep, no JSON, a number beyond a double (1e999) or
/// no object make an unread Wish; a command that is not as above is refused and the rest is taken.
Wish read_wish(std::string_view text);

/// What is told of one device, in the client's frame.
struct DeviceNews {
  struct State {
    Vec3 position;
    Vec3 velocity;
    Vec3 force;
    Quat orientation;
    std::uint32_t buttons;
    std::uint64_t tick;
    double age_ms;
    std::string reasons;
    double energy_j;
    double permitted_force_n;
    double force_age_ms;
    std::optional<Vec3> angular_velocity;
    std::optional<Vec3> torque;
    std::optional<double> grip_rad;
    std::optional<double> grip_force_n;
  };
  std::string_view name;
  std::string_view device_id;
  std::string_view grip_id;
  std::string_view permutation;
  bool left_handed = false;  ///< held by the left hand
  bool in_use = false;       ///< some client owns its force
  std::optional<State> state{};
};

struct News {
  std::optional<std::uint32_t> session_id{};  ///< with it, everything is told: each config too
  std::vector<DeviceNews> devices{};
  std::vector<std::string> refused{};
};

std::string to_json(const News& news);

/// The id of a device: eight hexadecimal digits made from its name, the same in every run.
std::string id_of(std::string_view name);

}  // namespace tendon::plug
