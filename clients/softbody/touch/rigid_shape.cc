// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/rigid_shape.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/softbody/touch/surface_distance.h"
#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

constexpr int kThinnestInCells = 2;  ///< minimum thickness
constexpr int kThickInCells = 6;     ///< maximum thickness that is measured

Triangles in_metres(const Triangles& surface, double scale) {
  Triangles made = surface;
  for (Vec3& point : made.points) point *= scale;
  return made;
}

constexpr double kCoreShare = 1e-9;  ///< relative to the rounding

/// Returns the minimum thickness (m) behind the centers of the facets.
double thickness_of(const Triangles& surface, const SurfaceDistance& distance, double cell, std::string_view name) {
  int least = kThickInCells;
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto& facet = surface.facets[f];
    const Vec3& a = surface.points[at(facet[0])];
    const Vec3& b = surface.points[at(facet[1])];
    const Vec3& c = surface.points[at(facet[2])];
    const Vec3 middle = (a + b + c) / 3;
    const Vec3 normal = (b - a).cross(c - a).normalized();
    int behind = 0;
    for (; behind < least; ++behind) {
      const double depth = (behind + 1) * cell;
      if (!(distance.at(middle - depth * normal, depth) < 0)) break;
    }
    least = behind;
    if (behind >= kThinnestInCells) continue;
    std::ostringstream text;
    text << name << ": facet " << surface.number(f) << " at (" << 1e3 * middle.x() << ", " << 1e3 * middle.y() << ", "
         << 1e3 * middle.z() << ") mm: the surface is thinner than " << kThinnestInCells << " cells of " << 1e3 * cell
         << " mm: use smaller cells";
    throw std::invalid_argument(text.str());
  }
  return least * cell;
}

}  // namespace

RigidShape::RigidShape(const Vec3& core, double rounding, const Mat3& turn)
    : core_(core),
      rounding_(rounding),
      turn_(turn),
      reach_(core.norm() + rounding),
      thinnest_(2 * (rounding + core.minCoeff())) {}

RigidShape::RigidShape(Mesh mesh)
    : mesh_(std::move(mesh)),
      reach_(std::ranges::max(mesh_->points, {}, &Vec3::squaredNorm).norm()),
      thinnest_(mesh_->thinnest) {}

Mat3 shortest_rotation(const Vec3& from, const Vec3& to) {
  const Vec3 a = from.normalized();
  const Vec3 b = to.normalized();
  const double cosine = a.dot(b);
  if (cosine < -1 + 1e-12) {
    const Vec3 near = std::abs(a.z()) < std::sqrt(0.5) ? Vec3(0, 0, 1) : Vec3(1, 0, 0);
    const Vec3 axis = (near - near.dot(a) * a).normalized();
    return Eigen::Quaterniond(0, axis.x(), axis.y(), axis.z()).toRotationMatrix();
  }
  const double twice = std::sqrt((1 + cosine) * 2);  // twice the cosine of half the angle
  const Vec3 axis = a.cross(b) / twice;
  return Eigen::Quaterniond(twice / 2, axis.x(), axis.y(), axis.z()).toRotationMatrix();
}

RigidShape RigidShape::sphere(double radius) {
  expect_above_zero(radius, "radius");
  return {Vec3::Zero(), radius, Mat3::Identity()};
}

RigidShape RigidShape::capsule(double radius, double half_length, const Vec3& axis) {
  expect_above_zero(radius, "radius");
  expect_not_negative(half_length, "half_length");
  expect(std::abs(axis.norm() - 1) < 1e-9, "norm of axis", axis.norm(), "1");
  return {Vec3(0, 0, half_length), radius, shortest_rotation(Vec3::UnitZ(), axis)};
}

RigidShape RigidShape::box(const Vec3& size, double edge) {
  for (const double length : size) expect_above_zero(length, "size");
  expect_above_zero(edge, "edge");
  expect(edge <= size.minCoeff() / 2, "edge", edge, "at most half of the smallest size");
  return {size / 2 - Vec3::Constant(edge), edge, Mat3::Identity()};
}

RigidShape RigidShape::mesh(const Triangles& surface, double scale, double cell, double around, std::string_view name) {
  expect_above_zero(scale, "scale");
  expect_above_zero(cell, "cell");
  expect_not_negative(around, "around");
  check(surface, name);
  const Triangles made = in_metres(surface, scale);
  const SurfaceDistance exact(made);
  const double thinnest = thickness_of(made, exact, cell, name);
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 high = -low;
  for (const Vec3& point : made.points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  Vec3 last = low;
  double there = std::numeric_limits<double>::infinity();
  const auto distance = [&](const Vec3& x) {
    const double value = exact.at(x, there + (x - last).norm());
    last = x;
    there = std::abs(value);
    return value;
  };
  const Vec3 border = Vec3::Constant(around + cell);
  try {
    const DistanceGrid grid(distance, low - border, high + border, cell);
    MeshFacts facts{.facets = made.facets.size(),
                    .size = high - low,
                    .cell = cell,
                    .points = grid.points(),
                    .bytes = grid.bytes() + made.points.size() * sizeof(Vec3),
                    .error = 0};
    const auto judge = [&](const Vec3& x) { facts.error = std::max(facts.error, std::abs(grid.at(x).value)); };
    for (const auto& facet : made.facets) {
      Vec3 middle = Vec3::Zero();
      for (std::size_t i = 0; i < 3; ++i) {
        const Vec3& corner = made.points[at(facet[i])];
        judge(corner);
        judge((corner + made.points[at(facet[(i + 1) % 3])]) / 2);
        middle += corner / 3;
      }
      judge(middle);
    }
    return RigidShape(Mesh{made.points, grid, facts, thinnest});
  } catch (const std::invalid_argument& refused) {
    throw std::invalid_argument(std::string(name) + ": " + refused.what());
  }
}

Distance RigidShape::distance(const Vec3& x) const {
  if (mesh_) return mesh_->grid.at(x);
  const Vec3 at = turn_.transpose() * x;
  const Vec3 sign = at.unaryExpr([](double value) { return std::copysign(1.0, value); });
  const Vec3 beyond = at.cwiseAbs() - core_;
  const Vec3 out = beyond.cwiseMax(0.0);
  const double away = out.norm();
  Distance found;
  if (away > kCoreShare * rounding_) {
    const Vec3 normal = sign.cwiseProduct(out) / away;
    const Vec3 round = (beyond.array() > 0).cast<double>();
    found.value = away - rounding_;
    found.gradient = turn_ * normal;
    const Mat3 across = Mat3(round.asDiagonal()) - normal * normal.transpose();
    found.curvature = turn_ * across * turn_.transpose() / away;
  } else {
    Eigen::Index side = 0;
    found.value = beyond.maxCoeff(&side) - rounding_;
    found.gradient = sign[side] * turn_.col(side);
  }
  return found;
}

double RigidShape::value(const Vec3& x) const {
  if (mesh_) return mesh_->grid.value(x);
  const Vec3 beyond = (turn_.transpose() * x).cwiseAbs() - core_;
  const double away = beyond.cwiseMax(0.0).norm();
  return (away > kCoreShare * rounding_ ? away : beyond.maxCoeff()) - rounding_;
}

Vec3 RigidShape::farthest(const Vec3& direction) const {
  if (mesh_) {
    return std::ranges::max(mesh_->points, {}, [&](const Vec3& point) { return point.dot(direction); });
  }
  Vec3 point = rounding_ * direction;
  for (int i = 0; i < 3; ++i) {
    const double along = turn_.col(i).dot(direction);
    if (std::abs(along) > 1e-9) point += std::copysign(core_[i], along) * turn_.col(i);
  }
  return point;
}

}  // namespace tendon::softbody
