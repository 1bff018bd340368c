// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "clients/softbody/fem/solid.h"

namespace tendon::softbody {

/// The surface compliance of a linear body, stored in a file. Computing it takes the time and memory of a factor of the
/// whole body; an answer from it takes microseconds for any mesh (CondensedModel).
///
/// File format, little-endian; the first column is the length in bytes:
///
///     8   "TENDONST"
///     4   version, 1                                4   m, the number of nodes
///     8   digest of the body                        8   patch_radius, m
///     8   stiffness, N/m                            8   linear_up_to, m
///     16  middle, m, across                         4 m nodes, ascending; then 4 zeros where m is odd
///     8 m (m + 1)/2   compliance, m/N: the lower half, row by row
///     8   XXH3 (64 bits) of everything before
struct SurfaceTable {
  std::uint64_t body = 0;        ///< digest_of() the solid and the normal
  double patch_radius = 0;       ///< m, of the patch used for `stiffness`
  double stiffness = 0;          ///< N/m, under the patch around `middle`
  double linear_up_to = 0;       ///< m, Body::linear_up_to()
  Eigen::Vector2d middle{0, 0};  ///< m, tangential
  std::vector<int> nodes{};      ///< mesh nodes, ascending
  Eigen::MatrixXd compliance{};  ///< m/N along the normal, symmetric, in the order of `nodes`
};

/// Identifies a body: mesh, fixed nodes, element, material, and touched side.
std::uint64_t digest_of(const Solid& solid, const Vec3& normal);

/// Throws std::runtime_error if the file cannot be written, or exists and is not a table.
void write_table(const std::filesystem::path& file, const SurfaceTable& table);

/// Throws std::invalid_argument, naming the file and the problem: not a table, truncated, bad checksum, or not positive
/// semidefinite (such a table could generate energy).
SurfaceTable read_table(const std::filesystem::path& file);

}  // namespace tendon::softbody
