// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody {

struct Shell {  // a closed part of a surface
  std::vector<std::size_t> facets;
  double volume = 0;  ///< negative if the facets point inwards
  int depth = 0;      ///< number of shells around it
  int within = -1;    ///< innermost of these, or −1
};

std::vector<Shell> shells(const Triangles& surface);  ///< if not closed, `depth` and `within` are undefined

/// A shell inside an even number of others is a body and must point outwards; inside an odd number, a cavity and
/// inwards. If not, or if there are too many, throws std::invalid_argument "`name`: …" with a facet and its place.
void check_shells(const Triangles& surface, std::string_view name);

std::vector<Triangles> bodies(const Triangles& surface);  ///< separates the bodies with their cavities

/// Returns Triangles::notes, and notes about cavities and about several bodies.
std::vector<std::string> notes_on(const Triangles& surface);

inline constexpr std::size_t kMostShells = 1000;

}  // namespace tendon::softbody
