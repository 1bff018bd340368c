// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "clients/softbody/fem/file_mesh.h"

namespace tendon::softbody {

/// Reads the volume elements of a gmsh mesh file: text formats 1, 2.2 and 4.1; tetrahedra or hexahedra (8, 20 or 27
/// nodes), all of one shape. Points, lines, faces and nodes without a volume element are ignored. Coordinates are
/// multiplied by `scale` to give m (1e-3 for a file in mm). The elements are passed to joined() with `slits`.
///
/// Throws std::invalid_argument "FILE: …" with the line or the file's element number if a number is missing, out of
/// range or not finite; a node is undefined or defined twice; an element repeats a node, is inverted or has no volume;
/// shapes are mixed; or the file contains several meshes. Also throws the errors of joined().
FileMesh read_gmsh(const std::filesystem::path& file, double scale, bool slits = false);

FileMesh parse_gmsh(std::string_view text, std::string_view name, double scale, bool slits = false);

/// Largest accepted file, in bytes. No model here is fast enough for a mesh with a million nodes.
inline constexpr std::uintmax_t kMaxMeshBytes = 256U << 20U;

}  // namespace tendon::softbody
