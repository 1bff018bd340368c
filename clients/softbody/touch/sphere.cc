// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/sphere.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "clients/softbody/touch/pushes.h"
#include "protocol/expect.h"

namespace tendon::softbody {

SphereContact::SphereContact(const CondensedModel& body, const TouchSurface& surface, double radius)
    : body_(body), surface_(surface), radius_(radius), pushed_(body.nodes().size()) {
  expect_above_zero(radius, "radius");
  for (const int node : surface.nodes()) {
    places_.push_back(surface.place(node));
    const auto found = std::ranges::lower_bound(body.nodes(), node);
    row_of_.push_back(found != body.nodes().end() && *found == node ? found - body.nodes().begin() : -1);
  }
}

std::vector<SphereContact::Overlap> SphereContact::overlaps(const Vec3& q, double& gap) const {
  const Vec3& n = surface_.normal();
  const Vec2 middle = surface_.across(q);
  std::vector<Overlap> all;
  gap = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Vec2 across = places_[i] - middle;
    const double down = std::sqrt(radius_ * radius_ - across.squaredNorm());
    if (!(down > 0)) continue;
    const double depth = surface_.height(surface_.nodes()[i]) - q.dot(n) + down;
    gap = std::min(gap, -depth);
    if (depth <= 0) continue;
    if (row_of_[i] < 0) throw std::out_of_range("the sphere leaves the condensed part of the body");
    all.push_back({row_of_[i], depth, n - surface_.from_across(across) / down});
  }
  return all;
}

Feel SphereContact::at(const Vec3& q) {
  Feel feel;
  feel.gap = std::numeric_limits<double>::infinity();
  contact_radius_ = 0;
  if (!q.allFinite()) return feel;
  const std::vector<Overlap> inside = overlaps(q, feel.gap);
  if (inside.empty()) {
    std::fill(pushed_.begin(), pushed_.end(), false);
    feel.valid_radius = feel.gap;
    return feel;
  }
  const auto count = static_cast<Eigen::Index>(inside.size());
  std::vector<bool> active(inside.size());
  for (std::size_t i = 0; i < inside.size(); ++i) active[i] = pushed_[static_cast<std::size_t>(inside[i].row)];
  MatrixXd table(count, count);
  VectorXd depth(count);
  for (Eigen::Index j = 0; j < count; ++j) {
    depth[j] = inside[static_cast<std::size_t>(j)].depth;
    for (Eigen::Index i = 0; i < count; ++i) {
      table(i, j) = body_.table()(inside[static_cast<std::size_t>(i)].row, inside[static_cast<std::size_t>(j)].row);
    }
  }

  const auto [set, push, factor] = least_pushes(table, depth, active);
  std::fill(pushed_.begin(), pushed_.end(), false);
  Eigen::Matrix<double, 3, Eigen::Dynamic> ways(3, static_cast<Eigen::Index>(set.size()));
  for (std::size_t k = 0; k < set.size(); ++k) {
    const Overlap& node = inside[static_cast<std::size_t>(set[k])];
    ways.col(static_cast<Eigen::Index>(k)) = node.way;
    pushed_[static_cast<std::size_t>(node.row)] = true;
    // |r|/√(R² − |r|²) is the tangent of the sphere surface's inclination there.
    const double lean = (node.way - surface_.normal()).norm();
    contact_radius_ = std::max(contact_radius_, radius_ * lean / std::sqrt(1 + lean * lean));
  }
  feel.force = ways * push;
  feel.stiffness = ways * factor.solve(ways.transpose());
  feel.valid_radius = std::max(-feel.gap, contact_radius_ / 4);
  feel.touching = true;
  return feel;
}

}  // namespace tendon::softbody
