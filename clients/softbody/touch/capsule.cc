// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/capsule.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "clients/softbody/models/linear.h"
#include "core/base/arithmetic.h"
#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

constexpr int kMostShapes = 50;

}  // namespace

CapsuleContact::CapsuleContact(const Solid& solid, const TouchSurface& surface, const std::vector<int>& nodes,
                               double radius, double half_length)
    : surface_(surface),
      radius_(radius),
      half_length_(half_length),
      compliance_(compliance_of(solid, nodes)),
      pushed_(nodes.size()) {
  expect_above_zero(radius, "radius");
  expect_not_negative(half_length, "half_length");
  for (const int node : surface.nodes()) {
    places_.push_back(solid.mesh().nodes[static_cast<std::size_t>(node)]);
    const auto found = std::ranges::lower_bound(nodes, node);
    row_of_.push_back(found != nodes.end() && *found == node ? found - nodes.begin() : -1);
  }
}

Vec3 CapsuleContact::Capsule::nearest_of_axis(const Vec3& y) const {
  return middle + std::clamp(axis.dot(y - middle), -half_length, half_length) * axis;
}

CapsuleContact::Plane CapsuleContact::Capsule::nearest(const Vec3& y, const Vec3& otherwise) const {
  const Vec3 centre = nearest_of_axis(y);
  const Vec3 out = y - centre;
  const double distance = out.norm();
  const Vec3 normal = distance > 1e-9 * radius ? Vec3(out / distance) : otherwise;
  return {centre + radius * normal, normal};
}

std::optional<double> CapsuleContact::Capsule::above(const Vec3& x, const Vec3& n) const {
  const Vec3 from = x - middle;
  std::optional<double> lowest;
  const auto take = [&](double height) {
    if (!lowest || height < *lowest) lowest = height;
  };
  for (const double end : {-half_length, half_length}) {
    const Vec3 out = from - end * axis;
    const double along = out.dot(n);
    const double inside = radius * radius - (out.squaredNorm() - along * along);
    if (inside > 0) take(-along - std::sqrt(inside));
  }
  // |out + t n|² = radius², with the components perpendicular to the axis.
  const double tilt = n.dot(axis);
  const double a = 1 - tilt * tilt;
  const double along = from.dot(axis);
  const double b = from.dot(n) - along * tilt;
  const double inside = b * b - a * (from.squaredNorm() - along * along - radius * radius);
  if (a > 1e-12 && inside > 0) {
    const double height = (-b - std::sqrt(inside)) / a;
    if (std::abs(along + height * tilt) <= half_length) take(height);
  }
  return lowest;
}

/// Returns the nodes inside, and those that a press may move into the capsule. `gap` is the minimum over all nodes.
std::vector<CapsuleContact::Node> CapsuleContact::near(const Capsule& tool, double& gap) const {
  const Vec3& n = surface_.normal();
  gap = std::numeric_limits<double>::infinity();
  std::vector<Node> all;
  const double reach = radius_ + half_length_;
  std::vector<std::size_t> around;
  std::vector<double> heights;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const Vec3 out = places_[i] - tool.middle;
    const double up = out.dot(n);
    if (out.squaredNorm() - up * up > 4 * reach * reach) continue;
    const double height = tool.above(places_[i], n).value_or(std::numeric_limits<double>::infinity());
    gap = std::min(gap, height);
    around.push_back(i);
    heights.push_back(height);
  }
  if (!(gap < 0)) return all;
  const double margin = std::min(-gap, reach);
  for (std::size_t k = 0; k < around.size(); ++k) {
    const Vec3& x = places_[around[k]];
    const bool inside = heights[k] < 0;
    if (!inside && (x - tool.nearest_of_axis(x)).norm() > radius_ + margin) continue;
    const Eigen::Index row = row_of_[around[k]];
    if (row < 0) {
      if (inside) throw std::out_of_range("the capsule leaves the condensed part of the body");
      continue;
    }
    if (compliance_(3 * row, 3 * row) == 0) {
      if (inside) throw std::out_of_range("the capsule touches a fixed part of the body");
      continue;
    }
    Plane plane = tool.nearest(x, -n);
    // The tool came from below.
    if (inside && plane.normal.dot(n) > -0.5) plane = tool.nearest(x + heights[k] * n, -n);
    all.push_back({row, x, x, plane});
  }
  return all;
}

void CapsuleContact::give_way(std::vector<Node>& nodes, const std::vector<Eigen::Index>& set,
                              const VectorXd& push) const {
  for (Node& node : nodes) node.at = node.at_rest;
  for (std::size_t k = 0; k < set.size(); ++k) {
    const Node& pushed = nodes[static_cast<std::size_t>(set[k])];
    const Vec3 force = push[static_cast<Eigen::Index>(k)] * pushed.plane.normal;
    for (Node& node : nodes) node.at += compliance_.block<3, 3>(3 * node.row, 3 * pushed.row) * force;
  }
}

/// The two stiffnesses from the capsule's translations along x, y, z and rotations about `about`. With w the motion of
/// the capsule at a node and v = δu − w the node's motion relative to it, the node's force on the body changes by
///
///     δf = m δλ + λ (P v/r + δθ × m),   δu = G δf,   m·v = 0
///
/// where P projects on the directions in which the capsule is curved. Fixed-point iteration: δλ with the previous v.
void CapsuleContact::add_slopes(const Capsule& tool, const Vec3& about, const std::vector<Node>& nodes,
                                const Pushes& pushes, Feel& feel) const {
  constexpr int kTurns = 5;  // each one reduces the error to a quarter
  const auto size = static_cast<Eigen::Index>(pushes.set.size());
  const auto node_of = [&](Eigen::Index k) -> const Node& {
    return nodes[static_cast<std::size_t>(pushes.set[static_cast<std::size_t>(k)])];
  };
  using Motions = Eigen::Matrix<double, Eigen::Dynamic, 6>;  // three rows for each node
  MatrixXd gives(3 * size, 3 * size);
  Motions w = Motions::Zero(3 * size, 6);
  Motions grows = Motions::Zero(3 * size, 6);  // λ δθ × m
  std::vector<Mat3> round;
  for (Eigen::Index k = 0; k < size; ++k) {
    const Node& node = node_of(k);
    const Vec3& m = node.plane.normal;
    for (Eigen::Index i = 0; i < size; ++i) {
      gives.block<3, 3>(3 * i, 3 * k) = compliance_.block<3, 3>(3 * node_of(i).row, 3 * node.row);
    }
    w.block<3, 3>(3 * k, 0) = Mat3::Identity();
    for (int c = 0; c < 3; ++c) {
      w.block<3, 1>(3 * k, 3 + c) = Vec3::Unit(c).cross(node.at - about);
      grows.block<3, 1>(3 * k, 3 + c) = pushes.push[k] * Vec3::Unit(c).cross(m);
    }
    Mat3 here = Mat3::Identity() - m * m.transpose();
    if (std::abs(tool.axis.dot(node.at - tool.middle)) < half_length_) here -= tool.axis * tool.axis.transpose();
    round.emplace_back(pushes.push[k] / radius_ * here);
  }
  Motions moved = w;  // δu
  Motions force(3 * size, 6);
  Motions across(size, 6);
  for (int turn = 0; turn < kTurns; ++turn) {
    for (Eigen::Index k = 0; k < size; ++k) {
      const Eigen::Matrix<double, 3, 6> past = moved.middleRows<3>(3 * k) - w.middleRows<3>(3 * k);
      force.middleRows<3>(3 * k) = round[static_cast<std::size_t>(k)] * past + grows.middleRows<3>(3 * k);
    }
    moved = gives * force;
    for (Eigen::Index k = 0; k < size; ++k) {
      across.row(k) = node_of(k).plane.normal.transpose() * (w.middleRows<3>(3 * k) - moved.middleRows<3>(3 * k));
    }
    across = pushes.factor.solve(across).eval();
    for (Eigen::Index k = 0; k < size; ++k) force.middleRows<3>(3 * k) += node_of(k).plane.normal * across.row(k);
    moved = gives * force;
  }
  Mat3 along = Mat3::Zero();
  Mat3 around = Mat3::Zero();
  for (Eigen::Index k = 0; k < size; ++k) {
    const Node& node = node_of(k);
    along += force.block<3, 3>(3 * k, 0);
    for (int c = 0; c < 3; ++c) {
      around.col(c) += moved.block<3, 1>(3 * k, 3 + c).cross(pushes.push[k] * node.plane.normal) +
                       (node.at - about).cross(force.block<3, 1>(3 * k, 3 + c));
    }
  }
  feel.stiffness = not_negative(along);
  feel.torque->stiffness = not_negative(around);
}

Feel CapsuleContact::at(const Vec3& middle, const Vec3& axis, const Vec3& about) {
  Feel feel;
  feel.torque.emplace();
  feel.gap = std::numeric_limits<double>::infinity();
  rounds_ = 0;
  if (!middle.allFinite() || !axis.allFinite() || !about.allFinite()) return feel;
  const Capsule tool{middle, axis, radius_, half_length_};
  std::vector<Node> nodes = near(tool, feel.gap);
  if (nodes.empty()) {
    std::fill(pushed_.begin(), pushed_.end(), false);
    feel.valid_radius = std::max(0.0, feel.gap);
    return feel;
  }

  const auto count = static_cast<Eigen::Index>(nodes.size());
  std::vector<bool> active(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) active[i] = pushed_[static_cast<std::size_t>(nodes[i].row)];
  if (std::ranges::find(active, true) == active.end()) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      active[i] = nodes[i].plane.normal.dot(nodes[i].plane.point - nodes[i].at_rest) > 0;
    }
  }
  MatrixXd table(count, count);
  VectorXd depth(count);
  Pushes pushes;
  Eigen::Matrix<double, 3, Eigen::Dynamic> ways;
  for (rounds_ = 1;; ++rounds_) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const Node& pushed = nodes[static_cast<std::size_t>(j)];
      depth[j] = pushed.plane.normal.dot(pushed.plane.point - pushed.at_rest);
      for (Eigen::Index i = j; i < count; ++i) {
        const Node& node = nodes[static_cast<std::size_t>(i)];
        table(i, j) =
            node.plane.normal.dot(compliance_.block<3, 3>(3 * node.row, 3 * pushed.row) * pushed.plane.normal);
        table(j, i) = table(i, j);
      }
    }
    pushes = least_pushes(table, depth, active);
    give_way(nodes, pushes.set, pushes.push);
    const auto size = static_cast<Eigen::Index>(pushes.set.size());
    ways.resize(3, size);
    for (Eigen::Index k = 0; k < size; ++k) {
      ways.col(k) = -nodes[static_cast<std::size_t>(pushes.set[static_cast<std::size_t>(k)])].plane.normal;
    }
    for (Node& node : nodes) node.plane = tool.nearest(node.at, node.plane.normal);
    feel.error = 0;
    for (Eigen::Index k = 0; k < size; ++k) {
      const Plane& now = nodes[static_cast<std::size_t>(pushes.set[static_cast<std::size_t>(k)])].plane;
      feel.error += pushes.push[k] * (now.normal + ways.col(k)).norm();
    }
    if (feel.error <= kEnough * pushes.push.sum() || rounds_ == kMostShapes) break;
  }

  std::fill(pushed_.begin(), pushed_.end(), false);
  const auto size = static_cast<Eigen::Index>(pushes.set.size());
  Eigen::Matrix<double, 6, Eigen::Dynamic> unit(6, size);
  unit.topRows<3>() = ways;
  double wide = 0;  // m
  for (Eigen::Index k = 0; k < size; ++k) {
    const Node& node = nodes[static_cast<std::size_t>(pushes.set[static_cast<std::size_t>(k)])];
    unit.col(k).tail<3>() = (node.at - about).cross(ways.col(k));
    wide = std::max(wide, radius_ * ways.col(k).cross(surface_.normal()).norm());
    pushed_[static_cast<std::size_t>(node.row)] = true;
  }
  const Eigen::Matrix<double, 6, 1> sum = unit * pushes.push;
  feel.force = sum.head<3>();
  feel.torque->torque = sum.tail<3>();
  add_slopes(tool, about, nodes, pushes, feel);
  feel.valid_radius = std::max(-feel.gap, wide / 4);
  feel.touching = size > 0;
  return feel;
}

std::size_t CapsuleContact::bytes() const noexcept {
  return static_cast<std::size_t>(compliance_.size()) * sizeof(double) + places_.size() * sizeof(Vec3) +
         row_of_.size() * sizeof(Eigen::Index);
}

}  // namespace tendon::softbody
