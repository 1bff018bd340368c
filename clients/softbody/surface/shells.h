// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody {

/// A closed part of a surface. Its facets are connected by edges.
struct Shell {
  std::vector<std::size_t> facets;
  double volume = 0;  ///< negative if the facets point inwards
  int depth = 0;      ///< the number of shells that contain it
  int within = -1;    ///< the innermost of these, or −1
};

/// The shells in the order of their first facets. If the surface is not closed, `depth` and `within` are undefined.
std::vector<Shell> shells(const Triangles& surface);

/// A shell inside an even number of others is a body and must point outwards. A shell inside an odd number of others
/// is a cavity and must point inwards. Otherwise, or if there are more than kMostShells, throws std::invalid_argument
/// "`name`: …" with a facet and its place.
void check_shells(const Triangles& surface, std::string_view name);

/// Separates the bodies. Each result contains one body and its cavities.
std::vector<Triangles> bodies(const Triangles& surface);

/// Triangles::notes, and a note if the surface has cavities or more than one body.
std::vector<std::string> notes_on(const Triangles& surface);

inline constexpr std::size_t kMostShells = 1000;

}  // namespace tendon::softbody
