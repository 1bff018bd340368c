// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "tests/clients/softbody/touch/half_space.h"

namespace tendon::softbody::testing {

/// B1 with cells of width `cell` (m) within ± `fine_x` and ± `fine_y` of the center of its top, growing outside.
struct FineBlock {
  FineBlock(double cell, double fine_x, double fine_y, double poisson = 0.45)
      : xs(across(cell, fine_x)), ys(across(cell, fine_y)), zs(up(cell)), solid(make(poisson)) {}

  std::vector<double> xs;
  std::vector<double> ys;
  std::vector<double> zs;
  Solid solid;

 private:
  static std::vector<double> across(double cell, double fine) {
    const auto cells = static_cast<int>(std::lround(fine / cell));
    std::vector<double> half;
    for (int i = 1; i <= cells; ++i) half.push_back(i * cell);
    const std::vector<double> outer = graded(1.5 * cell, 0.05 - cells * cell, 4);
    for (std::size_t i = 1; i < outer.size(); ++i) half.push_back(cells * cell + outer[i]);
    std::vector<double> all;
    for (auto x = half.rbegin(); x != half.rend(); ++x) all.push_back(-*x);
    all.push_back(0);
    all.insert(all.end(), half.begin(), half.end());
    return all;
  }
  static std::vector<double> up(double cell) {
    std::vector<double> all;
    const std::vector<double> down = graded(cell, 0.05, 7);
    for (auto z = down.rbegin(); z != down.rend(); ++z) all.push_back(0.05 - *z);
    all.front() = 0;
    return all;
  }
  Solid make(double poisson) const {
    Mesh mesh = block(Shape::kHex8, xs, ys, zs);
    const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
    return {std::move(mesh), Element::kHex8Sri, {.young = 1e4, .poisson = poisson}, Law::kLinear, fixed};
  }
};

/// Reference solution for a rigid capsule on a linear body. The surface is a stiff cushion with a pressure of
/// `cushion` (Pa/m) times the penetration. Newton's method on all unknowns minimizes the energy, and force and torque
/// are integrals of the pressure. The engine's compliance, active set and tangent plane are not used.
class ContactIntegral {
 public:
  struct Tool {
    Vec3 middle;
    Vec3 axis;
    double radius;
    double half_length;
  };
  struct Sum {
    Vec3 force = Vec3::Zero();           ///< N, on the tool
    Vec3 torque = Vec3::Zero();          ///< N·m, about the given point
    double area = 0;                     ///< contact area, m²
    double deepest = 0;                  ///< largest compression of the cushion, m
    Vec3 support = Vec3::Zero();         ///< force of the floor on the body, N
    Vec3 support_torque = Vec3::Zero();  ///< N·m, about the same point
    double energy = 0;                   ///< J
  };

  enum class Rule { kNodes, kGauss };

  ContactIntegral(const FineBlock& block, double cushion, Rule rule) : solid_(block.solid), cushion_(cushion) {
    const Mesh& mesh = solid_.mesh();
    for (const Facet& facet : surface(mesh)) {
      const std::vector<int> nodes = nodes_on(mesh, facet);
      if (!std::ranges::all_of(nodes, [&](int node) { return at_rest(node).z() > 0.05 - 1e-9; })) continue;
      Vec3 low = at_rest(nodes[0]);
      Vec3 high = low;
      for (const int node : nodes) {
        low = low.cwiseMin(at_rest(node));
        high = high.cwiseMax(at_rest(node));
      }
      const Vec3 size = high - low;
      const double edge = rule == Rule::kNodes ? 1 : 1 / std::sqrt(3.0);
      for (const double s : {-edge, edge}) {
        for (const double t : {-edge, edge}) {
          Point point{.nodes = {}, .shares = {}, .area = size.x() * size.y() / 4};
          for (std::size_t i = 0; i < 4; ++i) {
            const Vec3 from = 2 * (at_rest(nodes[i]) - (low + high) / 2);
            point.nodes[i] = nodes[i];
            point.shares[i] = (1 + s * from.x() / size.x()) * (1 + t * from.y() / size.y()) / 4;
          }
          points_.push_back(point);
        }
      }
    }
    stiffness_ = solid_.exact_stiffness(VectorXd::Zero(solid_.size()));
  }

  Sum press(const Tool& tool, const Vec3& about) const {
    VectorXd u = VectorXd::Zero(solid_.size());
    Factor factor(stiffness_);
    bool bends = false;  // near the solution the tangent includes the rotation of the normals
    for (int round = 0;; ++round) {
      if (round == 60) throw std::runtime_error("the cushion does not come to rest");
      SymmetricMatrix tangent = stiffness_;
      VectorXd left = stiffness_.times(solid_.to_free(u));
      for (const Point& point : points_) add(point, tool, u, bends, tangent, left);
      if (!factor.factorize(tangent)) throw std::runtime_error("the cushion pushes the body aside");
      const VectorXd step = factor.solve(left);
      double share = 1;
      const double before = energy(tool, u);
      VectorXd next = u;
      solid_.add_free(-step, next);
      while (energy(tool, next) > before + 1e-15 && share > 1e-6) {
        share /= 2;
        next = u;
        solid_.add_free(-share * step, next);
      }
      u = next;
      bends = share == 1 && step.lpNorm<Eigen::Infinity>() < 1e-4;
      if (share == 1 && step.lpNorm<Eigen::Infinity>() < 1e-8) break;
    }
    Sum sum;
    sum.energy = energy(tool, u);
    for (const Point& point : points_) {
      const Vec3 y = place(point, u);
      const auto [depth, normal] = inside(tool, y);
      if (depth <= 0) continue;
      const Vec3 force = -cushion_ * depth * point.area * normal;
      sum.force += force;
      sum.torque += (y - about).cross(force);
      sum.area += point.area;
      sum.deepest = std::max(sum.deepest, depth);
    }
    const VectorXd resists = solid_.forces(u).force;
    for (std::size_t node = 0; node < solid_.mesh().nodes.size(); ++node) {
      if (solid_.free_of(3 * static_cast<int>(node)) >= 0) continue;
      const Vec3 force = resists.segment<3>(static_cast<Eigen::Index>(3 * node));
      sum.support += force;
      sum.support_torque += (solid_.mesh().nodes[node] - about).cross(force);
    }
    return sum;
  }

 private:
  struct Point {
    std::array<int, 4> nodes;
    std::array<double, 4> shares;
    double area;
  };

  const Vec3& at_rest(int node) const { return solid_.mesh().nodes[static_cast<std::size_t>(node)]; }

  Vec3 place(const Point& point, const VectorXd& u) const {
    Vec3 y = Vec3::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      y += point.shares[i] * (at_rest(point.nodes[i]) + u.segment<3>(3 * point.nodes[i]));
    }
    return y;
  }

  /// Penetration of y into the tool, and the outward direction.
  static std::pair<double, Vec3> inside(const Tool& tool, const Vec3& y) {
    const double along = std::clamp(tool.axis.dot(y - tool.middle), -tool.half_length, tool.half_length);
    const Vec3 out = y - tool.middle - along * tool.axis;
    return {tool.radius - out.norm(), out.normalized()};
  }

  double energy(const Tool& tool, const VectorXd& u) const {
    const VectorXd free = solid_.to_free(u);
    double all = free.dot(stiffness_.times(free)) / 2;
    for (const Point& point : points_) {
      const double depth = std::max(0.0, inside(tool, place(point, u)).first);
      all += cushion_ * point.area * depth * depth / 2;
    }
    return all;
  }

  void add(const Point& point, const Tool& tool, const VectorXd& u, bool bends, SymmetricMatrix& tangent,
           VectorXd& left) const {
    const Vec3 y = place(point, u);
    const auto [depth, normal] = inside(tool, y);
    if (depth <= 0) return;
    // The normal turns as y moves around an end or around the axis.
    Mat3 round = Mat3::Identity() - normal * normal.transpose();
    if (std::abs(tool.axis.dot(y - tool.middle)) < tool.half_length) round -= tool.axis * tool.axis.transpose();
    round /= tool.radius - depth;
    const Mat3 k = cushion_ * point.area * (normal * normal.transpose() - (bends ? depth : 0) * round);
    const Vec3 push = cushion_ * point.area * depth * normal;
    for (std::size_t a = 0; a < 4; ++a) {
      if (point.shares[a] == 0) continue;
      for (int i = 0; i < 3; ++i) {
        const int row = solid_.free_of(3 * point.nodes[a] + i);
        if (row < 0) continue;
        left[row] -= point.shares[a] * push[i];
        for (std::size_t b = 0; b < 4; ++b) {
          if (point.shares[b] == 0) continue;
          for (int j = 0; j < 3; ++j) {
            const int column = solid_.free_of(3 * point.nodes[b] + j);
            if (column < 0 || column > row) continue;
            tangent.values[static_cast<std::size_t>(tangent.slot(row, column))] +=
                point.shares[a] * point.shares[b] * k(i, j);
          }
        }
      }
    }
  }

  const Solid& solid_;
  double cushion_;
  std::vector<Point> points_;
  SymmetricMatrix stiffness_;
};

}  // namespace tendon::softbody::testing
