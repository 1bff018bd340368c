// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "clients/softbody/fem/solid.h"

namespace tendon::softbody {

/// How a linear body gives way at its surface, made once and kept in a file: where it is made, there have to be the
/// time and the memory for a factor of the whole body; where it is used, an answer takes microseconds whatever the mesh
/// (CondensedModel).
///
/// The file, little-endian, lengths in bytes:
///
///     8   "TENDONST"
///     4   version, 1                                4   m, the number of nodes
///     8   digest of the body                        8   patch_radius, m
///     8   stiffness, N/m                            8   linear_up_to, m
///     16  middle, m, across                         4 m nodes, ascending; then 4 zeros where m is odd
///     8 m (m + 1)/2   compliance, m/N: the lower half, row by row
///     8   XXH3 (64 bits) of everything before
struct SurfaceTable {
  std::uint64_t body = 0;        ///< digest_of the solid and the normal
  double patch_radius = 0;       ///< m, of the patch of the next
  double stiffness = 0;          ///< N/m, under the patch around `middle`, when the table was made
  double linear_up_to = 0;       ///< m, Body::linear_up_to()
  Eigen::Vector2d middle{0, 0};  ///< m, across the normal
  std::vector<int> nodes{};      ///< of the mesh, ascending
  Eigen::MatrixXd compliance{};  ///< m/N along the normal; rows and columns as `nodes`, symmetric
};

/// Tells bodies apart: mesh, what of it is held, element, material, and the side that is touched.
std::uint64_t digest_of(const Solid& solid, const Vec3& normal);

/// Throws std::runtime_error when the file cannot be written, or is there and is no table.
void write_table(const std::filesystem::path& file, const SurfaceTable& table);

/// Throws std::invalid_argument, naming the file and what is wrong: no table, cut off, changed (its checksum), or not
/// positive semidefinite, which could give out energy that nobody had put in.
SurfaceTable read_table(const std::filesystem::path& file);

}  // namespace tendon::softbody
