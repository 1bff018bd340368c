// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>

#include "clients/softbody/fem/file_mesh.h"

namespace tendon::softbody {

/// Reads the volume elements of a mesh file of gmsh: text of the formats 1, 2.2 and 4.1, tetrahedra or hexahedra (8,
/// 20 or 27 nodes), of one shape. Points, lines and faces are left out, and so are nodes that no volume element has.
/// Coordinates are multiplied by `scale` to become m: 1e-3 for a file in mm. joined() makes one body of the elements,
/// and `slits` is passed to it.
///
/// Strict: throws std::invalid_argument "FILE: …" that names the element (by the file's own number) or the line when
/// a number is missing, out of range or not finite, a node is not there or named twice, an element has a node twice, is
/// turned inside out or has no volume, shapes are mixed, or there are several meshes; and what joined() throws.
FileMesh read_gmsh(const std::filesystem::path& file, double scale, bool slits = false);

/// The same for text in memory; errors call it `name`.
FileMesh parse_gmsh(std::string_view text, std::string_view name, double scale, bool slits = false);

/// Bytes of the largest file: no model here is fast enough for a mesh with a million nodes.
inline constexpr std::uintmax_t kMaxMeshBytes = 256U << 20U;

}  // namespace tendon::softbody
