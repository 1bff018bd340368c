// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <utility>
#include <vector>

#include "clients/softbody/fem/solid.h"

namespace tendon::softbody::testing {

/// From 0 to `length`. The first layer is `first` thick, and the thickness grows by a constant factor.
inline std::vector<double> graded(double first, double length, int count) {
  double low = 1;
  double high = 4;
  for (int i = 0; i < 60; ++i) {
    const double q = 0.5 * (low + high);
    (first * (std::pow(q, count) - 1) / (q - 1) > length ? high : low) = q;
  }
  std::vector<double> layers{0};
  double step = first;
  for (int i = 0; i < count; ++i, step *= low) layers.push_back(layers.back() + step);
  return layers;
}

/// A quarter of a half space below z = 0, touched at x = y = 0. The layer boundaries are at distances `out` from there.
inline Solid quarter_of_half_space(Element element, const std::vector<double>& out, const Material& material) {
  const double length = out.back();
  std::vector<double> down;
  for (auto layer = out.rbegin(); layer != out.rend(); ++layer) down.push_back(-*layer);
  Mesh mesh = block(info(element).shape, out, out, down);
  Fixed fixed(3 * mesh.nodes.size(), false);
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    const Vec3& node = mesh.nodes[i];
    const bool far = node.x() > length - 1e-9 || node.y() > length - 1e-9 || node.z() < -length + 1e-9;
    fixed[3 * i] = far || node.x() < 1e-9;
    fixed[3 * i + 1] = far || node.y() < 1e-9;
    fixed[3 * i + 2] = far;
  }
  return {std::move(mesh), element, material, Law::kLinear, fixed};
}

}  // namespace tendon::softbody::testing
