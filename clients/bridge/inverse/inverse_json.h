// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/bridge/view.h"
#include "protocol/messages.h"

/// Messages of Haply's Inverse service, version 3.5, as structs. Sources: its documentation, pages "WebSocket
/// Protocol", "Simulation Channel" and "Basis Permutation", and Isaac Lab's device class for the client side. SI units:
/// positions in m, velocities in m/s, forces on the hand in N, quaternions as w x y z.
///
/// Input; all fields are optional, and unknown fields are ignored and counted:
///
///     {"session": {"configure": {"basis": {"permutation": "XZY"}}, "force_render_full_state": {}},
///      "inverse3": [{"device_id": "8C4A51F0",
///                    "configure": {"basis": {"permutation": "XZY"}},
///                    "commands": {"set_cursor_force": {"vector": {"x": 0, "y": 0, "z": 1.5}},   // or "values"
///                                 "probe_position": {},
///                                 "tendon": {"torque_nm": {"x": 0, "y": 0, "z": 0.01}, "grip_force_n": 0.5}}}]}
///
/// Output for each device. "session_id" and "config" are only in the first message and after "force_render_full_state":
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
/// If the server of a device does not answer, "state" is missing and "ready" and "connected" are false. If a device
/// does not measure a quantity in the last line, this quantity is missing.
///
/// Thread-safe: yes (stateless). Realtime-safe: no.
namespace tendon::bridge {

/// Returns the matrix B of a basis permutation, v_client = B v_service, where the service has x right, y forward, z
/// up. In "X-ZY", y of the client is −z of the service. X, Y and Z must each occur once, with an optional sign;
/// otherwise returns nullopt. 24 of the 48 permutations are left-handed.
std::optional<Mat3> basis_of(std::string_view permutation);

Frame inverse_frame(const Mat3& basis);  ///< frame of a client: the frame of the service, rotated by B

struct DeviceWish {
  std::string device_id;
  std::optional<std::string> permutation;
  /// From a force command: force in the frame of the client, N, acting on the hand; torque in N·m, grip force in N.
  std::optional<Vec3> force;
  std::optional<Vec3> torque;
  std::optional<double> grip_force;
};

struct Wish {
  bool read = false;                       ///< false if the message is invalid; `refused` contains the reason
  std::optional<std::string> permutation;  ///< of the session
  bool full_state = false;
  std::vector<DeviceWish> devices;
  std::vector<std::string> refused;  ///< reasons for rejected parts; at most 8
  std::uint64_t ignored = 0;
};

inline constexpr std::size_t kLongestMessage = 64 * 1024;  ///< bytes; all commands for 16 devices need 6 kB
inline constexpr int kDeepest = 16;                        ///< nesting depth; valid messages have 5
inline constexpr std::size_t kMostRefusals = 8;            ///< per reply

/// Parses a message. Never throws. `read` is false if it is too long, too deep or not a JSON object, or if a number
/// exceeds double (1e999). Invalid commands are refused individually.
Wish read_wish(std::string_view text);

struct DeviceNews {  // for one device, in the frame of the client
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
  bool left_handed = false;
  bool in_use = false;
  std::optional<State> state{};
};

struct News {
  std::optional<std::uint32_t> session_id{};  ///< if set, the message also contains every config
  std::vector<DeviceNews> devices{};
  std::vector<std::string> refused{};
};

std::string to_json(const News& news);

std::string id_of(std::string_view name);  ///< id of a device: eight hexadecimal digits, computed from its name

}  // namespace tendon::bridge
