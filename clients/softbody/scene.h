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

/// The body that tendon-softbody simulates, and its place in front of the device.
struct Scene {
  BodyConfig body;
  Vec3 at = Vec3::Zero();             ///< m, device frame: the touch point of the body at rest
  Vec3 towards_hand = Vec3::UnitZ();  ///< unit vector, device frame: the direction from the body to the tool
  /// Several hands that hold the body at once, each at a device of its own; empty: one hand, at `at`.
  struct Hand {
    std::string device;      ///< its name at its server
    std::string server;      ///< HOST:PORT; empty: the one of the command line
    Vec3 at = Vec3::Zero();  ///< m, as Scene::at, in the frame of this device
  };
  std::vector<Hand> hands = {};
  double table = 0;  ///< m, the depths that an answer's table of forces covers; 0: no table
};

/// Turns the body's frame into the device's.
Mat3 to_device(const Scene& scene);

/// An error in a scene: "FILE:LINE: KEY: expected …, found …".
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a scene file (TOML); `scene_reference()` lists its keys. Only the effects listed in `effects` are simulated. A
/// listed effect that the model does not simulate is an error, and so is an effect that the model always simulates when
/// it is not listed. Throws SceneError, or std::runtime_error if the file cannot be read.
Scene read_scene(const std::filesystem::path& file);

/// The same for text in memory. Errors call it `name`; the path of a mesh is relative to `directory`.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory);

/// Every key that a scene may have, and every name that a value may have.
std::string scene_reference();

/// Warnings about this body, including the repairs in its mesh file and its tool file. Reads both files. Throws
/// std::invalid_argument if a file cannot be read.
std::vector<std::string> warnings(const BodyConfig& body);
/// Writes each warning as a line "PROGRAM: warning: …".
void warn(std::ostream& to, std::string_view program, const BodyConfig& body);

/// m, how deep a patch may press a nonlinear body before its fixed size makes a force that a rigid tool would not have;
/// ∞ for other models and tools. And the warning for one that is deeper.
double patch_up_to(const BodyConfig& body);
std::string beyond_the_patch(const BodyConfig& body);

/// The warning for a tool that is deeper than Body::linear_up_to(), m.
std::string turned_too_far(double linear_up_to);

}  // namespace tendon::softbody
