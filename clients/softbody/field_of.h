// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "clients/cpp/field/field.h"
#include "clients/softbody/surface/triangles.h"
#include "clients/softbody/touch/surface_distance.h"

namespace tendon::softbody {

/// Samples the inside of a closed surface (m) as a field for ForceClient::use. The sampled solid is larger than the
/// surface by the radius `grown` (m) of the tool. Throws std::invalid_argument as check() and Field::from.
/// Realtime-safe: no.
inline Field field_of(const Triangles& surface, const Field::Sampling& sampling, std::string_view name = "surface",
                      double grown = 0) {
  check(surface, name);
  Vec3 low = surface.points.front();
  Vec3 high = low;
  for (const Vec3& point : surface.points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  const Vec3 margin = Vec3::Constant(grown + 3 * sampling.spacing);  // BrickField::kBand is 2.5
  const SurfaceDistance distance(surface);
  return Field::from([&](const Vec3& x) { return distance.at(x) - grown; }, low - margin, high + margin, sampling);
}

}  // namespace tendon::softbody
