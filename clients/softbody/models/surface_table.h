// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "clients/softbody/fem/solid.h"

namespace tendon::softbody {

/// The surface compliance of a linear body. It needs a factor of the whole body once, then some microseconds per answer
/// (CondensedModel). The file is little-endian; the first column is the number of bytes:
///
///     8   "TENDONST"
///     4   version, 1                                4   m, the number of nodes
///     8   digest of the body                        8   patch_radius, m
///     8   stiffness, N/m                            8   linear_up_to, m
///     16  middle, m, across                         4 m nodes, ascending; then 4 zeros where m is odd
///     8 m (m + 1)/2   compliance, m/N: the lower half, row by row
///     8   XXH3 (64 bits) of everything before
struct SurfaceTable {
  std::uint64_t body = 0;        ///< digest_of() the body
  double patch_radius = 0;       ///< m, for `stiffness`
  double stiffness = 0;          ///< N/m, with the patch at `middle`
  double linear_up_to = 0;       ///< m, Body::linear_up_to()
  Eigen::Vector2d middle{0, 0};  ///< m, tangential
  std::vector<int> nodes{};      ///< ascending
  Eigen::MatrixXd compliance{};  ///< m/N along the normal, symmetric
};

/// Returns a digest of the mesh, the fixed nodes, the element, the material and the touched side.
std::uint64_t digest_of(const Solid& solid, const Vec3& normal);

/// Throws std::runtime_error if the file cannot be written, or if it exists and is not a table.
void write_table(const std::filesystem::path& file, const SurfaceTable& table);

/// Throws std::invalid_argument unless it is a valid table: positive semidefinite, since others could generate energy.
SurfaceTable read_table(const std::filesystem::path& file);

}  // namespace tendon::softbody
