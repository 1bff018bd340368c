// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/patch.h"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

constexpr double kLeastFacing = 0.2588;  // cos 75°; steeper facets have almost no projected area

/// In patch radii. The compliance of B1 changes by 1e-5 while the patch moves over a facet; with 0.2, by 2e-4.
constexpr double kPiece = 0.1;

/// With two pieces for each side of a quadratic facet, block B1 with 32 cells is too soft by 0.3 %.
constexpr int kLeastCutsOfQuadratic = 4;

constexpr int kMostCuts = 32;  ///< limits facets that are wider than three patches

constexpr int kMostFacetNodes = 9;

constexpr double kFlat = 1e-6;  ///< relative to the width of the touchable side

}  // namespace

TouchSurface::TouchSurface(const Mesh& mesh, const Vec3& towards_tool, double radius)
    : normal_(towards_tool), radius_(radius) {
  expect(std::abs(normal_.norm() - 1) < 1e-9, "norm of towards_tool", normal_.norm(), "1");
  expect_above_zero(radius, "radius");
  // The first axis is x, unless this is the normal.
  const Vec3 start = std::abs(normal_.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 first = (start - start.dot(normal_) * normal_).normalized();
  across_ << first.transpose(), normal_.cross(first).transpose();
  for (const Vec3& node : mesh.nodes) {
    places_.emplace_back(across(node));
    heights_.push_back(normal_.dot(node));
  }
  for (const Facet& facet : surface(mesh)) add(mesh, facet);
  if (facets_.empty()) throw std::invalid_argument("no side of the body faces the tool");
  for (const Pieces& facet : facets_) nodes_.insert(nodes_.end(), facet.nodes.begin(), facet.nodes.end());
  std::ranges::sort(nodes_);
  nodes_.erase(std::unique(nodes_.begin(), nodes_.end()), nodes_.end());
  for (Pieces& facet : facets_) {
    for (int& node : facet.nodes) node = static_cast<int>(std::ranges::lower_bound(nodes_, node) - nodes_.begin());
  }
  look_for_a_curve();
}

void TouchSurface::look_for_a_curve() {
  // A plane by least squares.
  MatrixXd places(static_cast<Eigen::Index>(nodes_.size()), 3);
  VectorXd heights(places.rows());
  for (Eigen::Index i = 0; i < places.rows(); ++i) {
    const int node = nodes_[static_cast<std::size_t>(i)];
    places.row(i) << 1, place(node).transpose();
    heights[i] = height(node);
  }
  const Eigen::Vector3d plane = places.colPivHouseholderQr().solve(heights);
  const double width = (places.colwise().maxCoeff() - places.colwise().minCoeff()).norm();
  curved_ = (places * plane - heights).lpNorm<Eigen::Infinity>() > kFlat * width;
}

void TouchSurface::add(const Mesh& mesh, const Facet& facet) {
  const Face& face = faces(mesh.shape)[at(facet.face)];
  const auto element = mesh.element(facet.element);
  const bool triangle = mesh.shape == Shape::kTet4;
  const std::vector<int> nodes = nodes_on(mesh, facet);
  double size = 0;
  for (const int a : nodes) {
    for (const int b : nodes) size = std::max(size, (places_[at(a)] - places_[at(b)]).norm());
  }
  const int least = nodes.size() > 4 ? kLeastCutsOfQuadratic : 1;
  const int cuts =
      std::clamp(static_cast<int>(std::ceil(size / (std::numbers::sqrt2 * kPiece * radius_))), least, kMostCuts);

  struct Piece {
    Vec2 at;
    double area;
    VectorXd shares;
  };
  std::vector<Piece> pieces;
  const auto add_piece = [&](double s, double t, double reference_area) {
    const ShapeValues shape = shape_at(mesh.shape, face.origin + s * face.along_s + t * face.along_t);
    Mat3 jacobian = Mat3::Zero();
    Vec3 place = Vec3::Zero();
    VectorXd shares(static_cast<Eigen::Index>(nodes.size()));
    Eigen::Index next = 0;
    for (int i = 0; i < shape.value.size(); ++i) {
      const Vec3& node = mesh.nodes[at(element[at(i)])];
      jacobian += node * shape.gradient.col(i).transpose();
      place += shape.value[i] * node;
      if (std::ranges::find(nodes, element[at(i)]) != nodes.end()) shares[next++] = shape.value[i];
    }
    const Vec3 area = (jacobian * face.along_s).cross(jacobian * face.along_t);
    if (area.dot(normal_) < kLeastFacing * area.norm()) return;
    pieces.push_back({across(place), reference_area * area.dot(normal_), shares});
  };
  const double step = (triangle ? 1.0 : 2.0) / cuts;
  for (int i = 0; i < cuts; ++i) {
    for (int j = 0; j < (triangle ? cuts - i : cuts); ++j) {
      if (!triangle) {
        add_piece((i + 0.5) * step - 1, (j + 0.5) * step - 1, step * step);
        continue;
      }
      add_piece((i + 1 / 3.0) * step, (j + 1 / 3.0) * step, 0.5 * step * step);
      if (i + j + 1 < cuts) add_piece((i + 2 / 3.0) * step, (j + 2 / 3.0) * step, 0.5 * step * step);
    }
  }
  if (pieces.empty()) return;
  const auto count = static_cast<Eigen::Index>(pieces.size());
  Pieces& all = facets_.emplace_back();
  all.nodes = nodes;
  all.at.resize(2, count);
  all.area.resize(count);
  all.shares.resize(static_cast<Eigen::Index>(nodes.size()), count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Piece& piece = pieces[static_cast<std::size_t>(i)];
    all.at.col(i) = piece.at;
    all.area[i] = piece.area;
    all.shares.col(i) = piece.shares;
  }
  all.middle = all.at.rowwise().mean();
  all.reach = (all.at.colwise() - all.middle).colwise().norm().maxCoeff();
}

std::vector<int> TouchSurface::nodes_of_patches(const Vec2& middle, double reach) const {
  std::vector<bool> near(nodes_.size());
  for (const Pieces& facet : facets_) {
    const double nearest = (facet.at.colwise() - middle).colwise().norm().minCoeff();
    if (nearest > reach + radius_) continue;
    for (const int node : facet.nodes) near[at(node)] = true;
  }
  std::vector<int> nodes;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (near[i]) nodes.push_back(nodes_[i]);
  }
  return nodes;
}

std::optional<Patch> TouchSurface::patch(const Vec2& middle, double least_covered) const {
  return patch_around<false>(middle, least_covered);
}

std::optional<Patch> TouchSurface::patch_with_curvatures(const Vec2& middle, double least_covered) const {
  return patch_around<true>(middle, least_covered);
}

template <bool kCurved>
std::optional<Patch> TouchSurface::patch_around(const Vec2& middle, double least_covered) const {
  using Share = Eigen::Matrix<double, kCurved ? 6 : 3, 1>;  // weight, first and second derivatives
  if (!middle.allFinite()) return std::nullopt;
  const double top = 3 / (std::numbers::pi * radius_ * radius_);
  std::vector<Share> sums(nodes_.size(), Share::Zero());
  std::vector<bool> below(nodes_.size());
  Share total = Share::Zero();
  int count = 0;
  for (const Pieces& facet : facets_) {
    if ((facet.middle - middle).squaredNorm() >= (radius_ + facet.reach) * (radius_ + facet.reach)) continue;
    std::array<Share, kMostFacetNodes> of_facet;
    of_facet.fill(Share::Zero());
    const std::size_t corners = facet.nodes.size();
    bool touched = false;
    for (Eigen::Index i = 0; i < facet.area.size(); ++i) {
      const Vec2 from = (facet.at.col(i) - middle) / radius_;
      const double left = 1 - from.squaredNorm();
      if (left <= 0) continue;
      const double scale = top * facet.area[i] * left;
      Share share;
      share.template head<3>() << scale * left, 4 * scale * from.x() / radius_, 4 * scale * from.y() / radius_;
      if constexpr (kCurved) {
        const double curve = 4 * top * facet.area[i] / (radius_ * radius_);
        share.template tail<3>() << curve * (2 * from.x() * from.x() - left), curve * 2 * from.x() * from.y(),
            curve * (2 * from.y() * from.y() - left);
      }
      total += share;
      const double* const shares = facet.shares.col(i).data();
      for (std::size_t corner = 0; corner < corners; ++corner) of_facet[corner] += shares[corner] * share;
      touched = true;
    }
    if (!touched) continue;
    for (std::size_t corner = 0; corner < corners; ++corner) {
      const std::size_t node = at(facet.nodes[corner]);
      sums[node] += of_facet[corner];
      count += below[node] ? 0 : 1;
      below[node] = true;
    }
  }
  if (!(total[0] >= least_covered)) return std::nullopt;
  Patch patch;
  patch.covered = std::min(1.0, total[0]);
  patch.middle = middle;
  patch.weights.resize(count);
  patch.slopes.resize(2, count);
  if constexpr (kCurved) patch.curvatures.resize(3, count);
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    if (!below[node]) continue;
    const auto i = static_cast<Eigen::Index>(patch.nodes.size());
    patch.nodes.push_back(nodes_[node]);
    patch.weights[i] = sums[node][0] / total[0];
    const Vec2 all = total.template segment<2>(1);
    patch.slopes.col(i) = (sums[node].template segment<2>(1) - patch.weights[i] * all) / total[0];
    if constexpr (kCurved) {
      const Vec2 slope = patch.slopes.col(i);
      patch.curvatures.col(i) =
          (sums[node].template tail<3>() - patch.weights[i] * total.template tail<3>() -
           Vec3(2 * slope.x() * all.x(), slope.x() * all.y() + slope.y() * all.x(), 2 * slope.y() * all.y())) /
          total[0];
    }
  }
  return patch;
}

}  // namespace tendon::softbody
