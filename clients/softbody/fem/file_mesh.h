// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "clients/softbody/fem/elastic.h"
#include "clients/softbody/fem/mesh.h"

namespace tendon::softbody {

/// A mesh read from a file. Messages use the element numbers of the file.
struct FileMesh {
  Mesh mesh;
  std::vector<std::int64_t> numbers{};
  std::vector<int> parts{};
  std::vector<std::string> notes{};
};

/// Joins the elements of a file into one body. Each repair is added to `notes`.
///
/// - If elements have the same nodes, in any order, only the first is used (gmsh 2.2 writes one per physical group).
/// - Nodes at the same place (kSamePlace) are merged. If `slits` is true, they are not merged, because the mesh may
///   contain a slit or a crack. The note gives the number of places in both cases.
///
/// Elements that are connected by faces form a part. More than one part is not an error: see expect_held(). Throws
/// std::invalid_argument "`name`: …" with the element numbers of the file if an element has two nodes at the same
/// place, or if elements overlap: more than two share a face, or two are on the same side of a shared face.
FileMesh joined(FileMesh file, bool slits, std::string_view name);

/// Throws std::invalid_argument with the number and the place of an element if a part is not held. A part is held if it
/// has three nodes that are not collinear and that are fixed or belong to another held part. If there is only one part,
/// it is not checked.
void expect_held(const FileMesh& file, const Fixed& fixed, std::string_view name);

}  // namespace tendon::softbody
