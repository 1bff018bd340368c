// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "protocol/field/sender.h"
#include "protocol/messages.h"

namespace tendon {

/// The shape of an object that is rendered by the server (ForceClient::use): the union of all bricks and primitives, in
/// the frame of the object. All lengths are in m.
struct Field {
  struct Sampling {
    double spacing = 1e-3;      ///< m, of the nodes; walls must be at least twice as thick
    std::uint8_t material = 0;  ///< of all bricks
  };

  /// Samples a signed distance (m, negative inside the solid) between `low` and `high`. It is called at least once for
  /// each node near the surface. Throws std::invalid_argument if the spacing is not in 0.00025 … 0.008, or if there are
  /// too many bricks: a larger spacing needs fewer.
  static Field from(const std::function<double(const Vec3&)>& signed_distance, const Vec3& low, const Vec3& high,
                    const Sampling& sampling);

  /// Sets the stiffness and the table of a material, so that they match a measured curve. The forces (N) and the depths
  /// (m) must be increasing, and the curve starts at zero. If there are at most 16 points and they are equally spaced,
  /// the table contains these points. Otherwise, the curve is resampled at 16 depths. For greater depths, only the
  /// stiffness is used. Throws std::invalid_argument if the curve is not valid.
  void set_curve(std::uint32_t material, std::span<const double> depths, std::span<const double> forces);

  FieldLattice lattice{};
  std::vector<FieldSender::Brick> bricks{};                   ///< at most 1023
  std::vector<field::Primitive> primitives{};                 ///< at most 32
  std::vector<FieldMaterial> materials{{.stiffness = 1000}};  ///< 1 … 8; bricks and primitives contain an index
  std::vector<FieldFixture> fixtures{};                       ///< at most 4
  std::vector<FieldDepthTable> tables{};                      ///< at most 3, with the index of the material
};

/// The pose of the object of a field, and how it changes, in the base frame of the device.
struct ObjectPose {
  Vec3 position = Vec3::Zero();          ///< m, position of the origin of the object
  Quat orientation{};                    ///< from the frame of the object to the base frame
  Vec3 velocity = Vec3::Zero();          ///< m/s
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s, in the axes of the base frame
};

}  // namespace tendon
