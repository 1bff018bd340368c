// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "clients/softbody/body.h"

namespace tendon::softbody {

/// The simulated body and its place in front of the device.
struct Scene {
  BodyConfig body;
  Vec3 at = Vec3::Zero();             ///< m, device frame: touch point of the body at rest
  Vec3 towards_hand = Vec3::UnitZ();  ///< unit vector, device frame, from the body to the tool
  /// Several hands that hold the body together, each with its own device. Empty: one hand, at `at`.
  struct Hand {
    std::string device;      ///< name at its server
    std::string server;      ///< HOST:PORT; empty: the one of the command line
    Vec3 at = Vec3::Zero();  ///< m, device frame of this device; as Scene::at
  };
  std::vector<Hand> hands = {};
  double table = 0;  ///< m, depth range of the force table in an answer; 0: no table
};

/// Rotation from the body frame to the device frame.
Mat3 to_device(const Scene& scene);

/// An error in a scene: "FILE:LINE: KEY: expected …, found …".
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a scene file (TOML; scene_reference() lists the keys). Only listed effects are simulated. Listing an effect
/// that the model does not simulate is an error, and so is omitting one that it always simulates. Throws SceneError, or
/// std::runtime_error if the file cannot be read.
Scene read_scene(const std::filesystem::path& file);

/// Reads text in memory. `name` is used in error messages; mesh paths are relative to `directory`.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory);

/// Text that lists all scene keys and value names.
std::string scene_reference();

/// Warnings about the body, including repairs in its mesh and tool files, which are read. Throws std::invalid_argument
/// if a file cannot be read.
std::vector<std::string> warnings(const BodyConfig& body);
/// Writes each warning as a line "PROGRAM: warning: …".
void warn(std::ostream& to, std::string_view program, const BodyConfig& body);

/// Depth in m to which a patch may press a nonlinear body before its fixed size gives a force that a rigid tool would
/// not have; ∞ for other models and tools. beyond_the_patch() is the warning for a deeper tool.
double patch_up_to(const BodyConfig& body);
std::string beyond_the_patch(const BodyConfig& body);

/// Warning for a tool deeper than Body::linear_up_to(), m.
std::string turned_too_far(double linear_up_to);

}  // namespace tendon::softbody
