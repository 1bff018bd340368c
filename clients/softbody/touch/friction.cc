// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/friction.h"

#include <cmath>

#include "protocol/expect.h"

namespace tendon::softbody {

Friction::Friction(double coefficient, double stiffness) : coefficient_(coefficient), stiffness_(stiffness) {
  expect_not_negative(coefficient, "friction");
  expect(stiffness > 0, "stiffness", stiffness, "a number above 0 N/m");
}

Friction::Drag Friction::move(const Vec2& place, double normal_force) {
  if (!(normal_force > 0)) {
    let_go();
    return {};
  }
  if (!anchor_) anchor_ = place;
  const double most = coefficient_ * normal_force / stiffness_;  // m
  const Vec2 stretch = place - *anchor_;
  const double length = stretch.norm();
  if (length <= most) return {-stiffness_ * stretch, stiffness_, most - length};
  anchor_ = place - most / length * stretch;
  return {-stiffness_ * most / length * stretch, 0, 0};
}

double sideways_stiffness(const Material& material, double radius) {
  return 8 * material.mu() * radius / (2 - material.poisson);
}

}  // namespace tendon::softbody
