// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/fem/mesh.h"
#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody {

/// Returns the surface of a mesh, in m. Facets of quadratic elements are flat between their corners. The surface may
/// fail check(), for example at a slit. Realtime-safe: no.
Triangles outside(const Mesh& mesh);

}  // namespace tendon::softbody
