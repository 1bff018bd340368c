// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/softbody/body.h"
#include "server/scene/scene_error.h"

namespace tendon::softbody {

/// A body and its position relative to the device.
struct Scene {
  BodyConfig body;
  Vec3 at = Vec3::Zero();             ///< m, device frame: touch point of the body at rest
  Vec3 towards_hand = Vec3::UnitZ();  ///< unit vector, device frame, from the body to the tool
  /// Several hands. If this is empty, there is one hand at `at`.
  struct Hand {
    std::string device;
    std::string server;      ///< HOST:PORT; empty: the server of the command line
    Vec3 at = Vec3::Zero();  ///< m, in the frame of this device
  };
  std::vector<Hand> hands = {};
  double table = 0;  ///< m, depth range of the force table in an answer; 0: no table
  /// The shape at rest is uploaded, and the server renders it with this material. See FieldMaterial.
  struct Upload {
    double spacing = 2e-3;                     ///< m, distance of the nodes
    double stiffness = 0;                      ///< N/m
    double friction = 0;                       ///< coefficient
    std::optional<double> branch_stiffness{};  ///< N/m
    std::optional<double> relaxation{};        ///< s
  };
  std::optional<Upload> field = {};
};

Mat3 to_device(const Scene& scene);  ///< rotation from the body frame to the device frame

/// Reads a scene file (TOML). The effects in the file must include all effects that the model always simulates, and
/// only effects that it supports. Throws SceneError, or std::runtime_error if the file cannot be read.
Scene read_scene(const std::filesystem::path& file);

/// Mesh files are relative to `directory`. `name` is used in error messages.
Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory);

std::string scene_reference();  ///< description of all keys of a scene

/// Returns the warnings about the body and its files. Throws std::invalid_argument if a file cannot be read.
std::vector<std::string> warnings(const BodyConfig& body);
void warn(std::ostream& to, std::string_view program, const BodyConfig& body);  ///< lines "PROGRAM: warning: …"

/// Returns the depth (m) up to which a patch of fixed size is valid on a nonlinear body. Infinite for other models and
/// tools. beyond_the_patch() returns the warning for deeper tools.
double patch_up_to(const BodyConfig& body);
std::string beyond_the_patch(const BodyConfig& body);

std::string turned_too_far(double linear_up_to);  ///< warning for a tool that is deeper than Body::linear_up_to()

}  // namespace tendon::softbody
