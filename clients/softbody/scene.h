// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "clients/softbody/body.h"

namespace tendon::softbody {

/// The body that tendon-softbody simulates, and where it lies in front of the device.
struct Scene {
  BodyConfig body;
  Vec3 at = Vec3::Zero();             ///< m, device frame: where the touch point of the body at rest is
  Vec3 towards_hand = Vec3::UnitZ();  ///< unit vector, device frame: the body's way to the tool
  double table = 0;                   ///< m, the depths that an answer's table of forces covers; 0: it has none
};

/// An error in a scene: "FILE:LINE: KEY: expected …, found …".
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a scene file (TOML); `scene_reference()` lists its keys. Nothing is simulated that is not listed in `effects`,
/// and an effect that the model does not simulate, or one that it does and that is not listed, is an error. Throws
/// SceneError.
Scene read_scene(const std::filesystem::path& file);

/// The same for text in memory. `name` is what errors call it; a mesh is looked for relative to `directory`.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory);

/// Every key that a scene may have, and every name that a value may have.
std::string scene_reference();

/// Warnings that a person should read before trusting this body.
std::vector<std::string> warnings(const BodyConfig& body);

/// The same, once the tool is deeper than Body::linear_up_to(), m.
std::string turned_too_far(double linear_up_to);

}  // namespace tendon::softbody
