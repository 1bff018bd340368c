// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/effects/self_collision.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <unsupported/Eigen/BVH>
#include <utility>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

using Box = Eigen::AlignedBox3d;

constexpr double kBehind = 0.5;  ///< range of the search behind a facet, relative to its size
constexpr double kBefore = 1;    ///< in front of it

/// The tolerance in barycentric coordinates. With a smaller value, nodes at an edge would alternate between two states.
constexpr double kBeside = 0.15;

constexpr int kMostRounds = 2000;  ///< maximum number of Gauss–Seidel iterations
constexpr double kSettled = 1e-8;  ///< they end at this relative change

template <class Visit>
struct Around {
  const Vec3& place;
  Visit visit;
  // NOLINTNEXTLINE(readability-identifier-naming): the names that Eigen calls
  bool intersectVolume(const Box& box) const { return box.contains(place); }
  // NOLINTNEXTLINE(readability-identifier-naming)
  bool intersectObject(int triangle) const {
    visit(triangle);
    return false;
  }
};

}  // namespace

struct SelfCollision::Flat {
  std::array<Vec3, 3> corners;
  Vec3 out;  ///< its length is twice the area, m²

  /// Returns the barycentric coordinates. Empty if `place` is outside.
  std::optional<Vec3> across(const Vec3& place) const {
    Vec3 shares;
    for (int i = 0; i < 3; ++i) {
      const Vec3& next = corners[at((i + 1) % 3)];
      shares[i] = (corners[at((i + 2) % 3)] - next).cross(place - next).dot(out) / out.squaredNorm();
    }
    return shares.minCoeff() >= -kBeside ? std::optional(shares) : std::nullopt;
  }
};

double SelfCollision::Pair::gap(const VectorXd& u) const {
  double sum = offset;
  for (std::size_t i = 0; i < nodes.size(); ++i) sum += along[i].dot(u.segment<3>(3 * nodes[i]));
  return sum;
}

void SelfCollision::Pair::add(double force, VectorXd& to) const {
  for (std::size_t i = 0; i < nodes.size(); ++i) to.segment<3>(3 * nodes[i]) += force * along[i];
}

SelfCollision::SelfCollision(const Elastic& elastic, double bed, const VectorXd& u) : elastic_(elastic) {
  expect_above_zero(bed, "self_collision");
  const Mesh& mesh = elastic.mesh();
  for (const Facet& facet : sides(mesh)) add(facet);

  std::vector<double> areas(mesh.nodes.size());
  const std::vector<Flat> at_rest = lie(VectorXd::Zero(elastic.size()));
  for (Side& side : sides_) {
    double area = 0;
    for (int i = 0; i < side.triangles; ++i) area += 0.5 * at_rest[at(side.first_triangle + i)].out.norm();
    side.size = std::sqrt(area);
    for (const int node : side.nodes) areas[at(node)] += area / static_cast<double>(side.nodes.size());
  }

  std::vector<std::vector<int>> rings(mesh.nodes.size());
  for (int e = 0; e < mesh.element_count(); ++e) {
    const auto element = mesh.element(e);
    for (const int node : element) {
      if (areas[at(node)] > 0) rings[at(node)].insert(rings[at(node)].end(), element.begin(), element.end());
    }
  }
  for (std::size_t i = 0; i < rings.size(); ++i) {
    if (rings[i].empty()) continue;
    std::ranges::sort(rings[i]);
    rings[i].erase(std::unique(rings[i].begin(), rings[i].end()), rings[i].end());
    nodes_.push_back({static_cast<int>(i), 0.5 * bed * areas[i], std::move(rings[i])});
  }
  look(u);
}

void SelfCollision::add(const Facet& facet) {
  const Mesh& mesh = elastic_.mesh();
  const Face& face = faces(mesh.shape)[at(facet.face)];
  const auto element = mesh.element(facet.element);
  const auto side = static_cast<int>(sides_.size());
  const auto first_point = static_cast<int>(points_.size());
  const auto first_triangle = static_cast<int>(triangles_.size());
  const auto add_point = [&](double s, double t) {
    const ShapeValues shape = shape_at(mesh.shape, face.origin + s * face.along_s + t * face.along_t);
    Point& point = points_.emplace_back();
    for (int i = 0; i < shape.value.size(); ++i) {
      if (std::abs(shape.value[i]) < 1e-12) continue;
      point.nodes.push_back(element[at(i)]);
      point.shares.push_back(shape.value[i]);
    }
  };
  const auto add_triangle = [&](int a, int b, int c) {
    triangles_.push_back({side, {first_point + a, first_point + b, first_point + c}});
  };
  if (mesh.shape == Shape::kTet4) {
    add_point(0, 0);
    add_point(1, 0);
    add_point(0, 1);
    add_triangle(0, 1, 2);
  } else {
    add_point(0, 0);
    add_point(-1, -1);
    add_point(1, -1);
    add_point(1, 1);
    add_point(-1, 1);
    for (int i = 1; i <= 4; ++i) add_triangle(0, i, i % 4 + 1);
  }
  sides_.push_back({first_triangle, static_cast<int>(triangles_.size()) - first_triangle, 0, nodes_on(mesh, facet)});
}

std::vector<SelfCollision::Flat> SelfCollision::lie(const VectorXd& u) const {
  std::vector<Vec3> places(points_.size(), Vec3::Zero());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (std::size_t k = 0; k < points_[i].nodes.size(); ++k) {
      places[i] += points_[i].shares[k] * place(u, points_[i].nodes[k]);
    }
  }
  std::vector<Flat> flats(triangles_.size());
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) flats[i].corners[k] = places[at(triangles_[i].points[k])];
    const auto& [a, b, c] = flats[i].corners;
    flats[i].out = (b - a).cross(c - a);
  }
  return flats;
}

std::vector<Vec3> SelfCollision::node_normals(const std::vector<Flat>& flats) const {
  std::vector<Vec3> normals(elastic_.mesh().nodes.size(), Vec3::Zero());
  for (const Side& side : sides_) {
    Vec3 out = Vec3::Zero();
    for (int i = 0; i < side.triangles; ++i) out += flats[at(side.first_triangle + i)].out;
    for (const int node : side.nodes) normals[at(node)] += out;
  }
  return normals;
}

SelfCollision::Pair SelfCollision::pair(const SurfaceNode& node, int triangle, const Vec3& shares,
                                        const Flat& flat) const {
  const Vec3 normal = flat.out.normalized();
  Pair pair{node.node, node.stiffness, normal.dot(elastic_.mesh().nodes[at(node.node)]), {node.node}, {normal}};
  for (int i = 0; i < 3; ++i) {
    const Point& corner = points_[at(triangles_[at(triangle)].points[at(i)])];
    for (std::size_t k = 0; k < corner.nodes.size(); ++k) {
      const Vec3 along = -shares[i] * corner.shares[k] * normal;
      pair.nodes.push_back(corner.nodes[k]);
      pair.along.push_back(along);
      pair.offset += along.dot(elastic_.mesh().nodes[at(corner.nodes[k])]);
    }
  }
  return pair;
}

double SelfCollision::look(const VectorXd& u) {
  const VectorXd before = forces(u);
  const std::vector<Flat> flats = lie(u);
  const std::vector<Vec3> normals = node_normals(flats);
  std::vector<int> numbers(triangles_.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  std::vector<Box> boxes;
  boxes.reserve(flats.size());
  for (std::size_t i = 0; i < flats.size(); ++i) {
    Box box(flats[i].corners[0]);
    box.extend(flats[i].corners[1]).extend(flats[i].corners[2]);
    const double reach = std::max(kBehind, kBefore) * sides_[at(triangles_[i].side)].size;
    boxes.emplace_back(box.min().array() - reach, box.max().array() + reach);
  }
  const Eigen::KdBVH<double, 3, int> tree(numbers.begin(), numbers.end(), boxes.begin(), boxes.end());

  pairs_.clear();
  for (const SurfaceNode& node : nodes_) {
    const Vec3 here = place(u, node.node);
    double nearest = std::numeric_limits<double>::infinity();
    std::optional<Pair> found;
    const auto is_near = [&](int triangle) {
      const Flat& flat = flats[at(triangle)];
      const Side& side = sides_[at(triangles_[at(triangle)].side)];
      if (!(normals[at(node.node)].dot(flat.out) < 0)) return;
      const double gap = (here - flat.corners[0]).dot(flat.out) / flat.out.norm();
      if (!(std::abs(gap) < nearest) || gap < -kBehind * side.size || gap > kBefore * side.size) return;
      const auto on_ring = [&](int other) { return std::ranges::binary_search(node.ring, other); };
      if (std::ranges::any_of(side.nodes, on_ring)) return;
      if (const auto shares = flat.across(here)) {
        nearest = std::abs(gap);
        found = pair(node, triangle, *shares, flat);
      }
    };
    Around<decltype(is_near)> around{here, is_near};
    Eigen::BVIntersect(tree, around);
    if (found) pairs_.push_back(*std::move(found));
  }
  for (Pair& pair : pairs_) pair.pushed = pair.gap(u) < 0;
  const VectorXd now = forces(u);
  const double all = std::max(before.norm(), now.norm());
  return all > 0 ? (now - before).norm() / all : 0;
}

VectorXd SelfCollision::forces(const VectorXd& u) const {
  VectorXd all = VectorXd::Zero(u.size());
  for (const Pair& pair : pairs_) pair.add(pair.stiffness * std::min(0.0, pair.gap(u)), all);
  return all;
}

void SelfCollision::add_forces(const VectorXd& u, Elastic::Forces& to) const {
  to.force += elastic_.to_free(forces(u));
  for (const Pair& pair : pairs_) {
    const double gap = std::min(0.0, pair.gap(u));
    to.energy += 0.5 * pair.stiffness * gap * gap;
  }
}

MatrixXd SelfCollision::directions(const std::vector<const Pair*>& pairs) const {
  MatrixXd all(elastic_.free_count(), static_cast<Eigen::Index>(pairs.size()));
  for (Eigen::Index i = 0; i < all.cols(); ++i) {
    VectorXd along = VectorXd::Zero(elastic_.size());
    pairs[static_cast<std::size_t>(i)]->add(1, along);
    all.col(i) = elastic_.to_free(along);
  }
  return all;
}

double SelfCollision::foresee(const Factor& factor, const VectorXd& u, const VectorXd& b, const VectorXd* held,
                              double by) {
  std::vector<const Pair*> pairs;
  for (const Pair& pair : pairs_) pairs.push_back(&pair);
  const auto count = static_cast<Eigen::Index>(pairs.size());
  const MatrixXd along = directions(pairs);
  MatrixXd right(b.size(), count + 2);
  right << along, b, held != nullptr ? *held : VectorXd::Zero(b.size());
  const MatrixXd solution = factor.solve(right);
  VectorXd gaps = along.transpose() * solution.col(count);  // at the end of the step, without the bed
  MatrixXd matrix = along.transpose() * solution.leftCols(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    gaps[i] += pairs[static_cast<std::size_t>(i)]->gap(u);
    matrix(i, i) += 1 / pairs[static_cast<std::size_t>(i)]->stiffness;
  }
  double compliance = 0;
  VectorXd across;  // opening of the gaps per newton
  double force = 0;
  if (held != nullptr) {
    compliance = held->dot(solution.col(count + 1));
    across = along.transpose() * solution.col(count + 1);
    force = (by - held->dot(solution.col(count))) / compliance;
    gaps += force * across;
    matrix -= across * across.transpose() / compliance;
  }
  VectorXd push = VectorXd::Zero(count);
  for (int round = 0; round < kMostRounds; ++round) {
    double change = 0;
    for (Eigen::Index i = 0; i < count; ++i) {
      const double before = push[i];
      push[i] = std::max(0.0, before - (gaps[i] + matrix.col(i).dot(push)) / matrix(i, i));
      change = std::max(change, std::abs(push[i] - before));
    }
    if (change <= kSettled * push.lpNorm<Eigen::Infinity>()) break;
  }
  for (Eigen::Index i = 0; i < count; ++i) pairs_[static_cast<std::size_t>(i)].pushed = push[i] > 0;
  return held != nullptr ? force - across.dot(push) / compliance : 0;
}

bool SelfCollision::pushes(const VectorXd& u) const {
  return std::ranges::any_of(pairs_, [&](const Pair& pair) { return pair.pushed || pair.gap(u) < 0; });
}

VectorXd SelfCollision::foreseen_forces(const VectorXd& u) const {
  VectorXd all = VectorXd::Zero(u.size());
  for (const Pair& pair : pairs_) {
    const double gap = pair.gap(u);
    const bool behind = gap < 0;
    if (pair.pushed != behind) pair.add(pair.stiffness * (pair.pushed ? gap : -gap), all);
  }
  return elastic_.to_free(all);
}

MatrixXd SelfCollision::solve(const Factor& factor, const MatrixXd& b) const {
  std::vector<const Pair*> pushed;
  for (const Pair& pair : pairs_) {
    if (pair.pushed) pushed.push_back(&pair);
  }
  if (pushed.empty()) return factor.solve(b);
  const auto count = static_cast<Eigen::Index>(pushed.size());
  MatrixXd right(b.rows(), b.cols() + count);
  right << b, directions(pushed);
  const MatrixXd solution = factor.solve(right);
  const auto along = right.rightCols(count);
  const auto follows = solution.rightCols(count);
  MatrixXd compliance = along.transpose() * follows;
  for (Eigen::Index i = 0; i < count; ++i) compliance(i, i) += 1 / pushed[static_cast<std::size_t>(i)]->stiffness;
  const MatrixXd push = compliance.ldlt().solve(along.transpose() * solution.leftCols(b.cols()));
  return solution.leftCols(b.cols()) - follows * push;
}

double SelfCollision::overlap(const VectorXd& u) const {
  double deepest = 0;
  for (const Pair& pair : pairs_) deepest = std::max(deepest, -pair.gap(u));
  return deepest;
}

std::size_t SelfCollision::bytes() const noexcept {
  std::size_t sum = sizeof *this + triangles_.size() * sizeof(Triangle);
  for (const Point& point : points_) sum += sizeof point + point.nodes.size() * (sizeof(int) + sizeof(double));
  for (const Side& side : sides_) sum += sizeof side + side.nodes.size() * sizeof(int);
  for (const SurfaceNode& node : nodes_) sum += sizeof node + node.ring.size() * sizeof(int);
  for (const Pair& pair : pairs_) sum += sizeof pair + pair.nodes.size() * (sizeof(int) + sizeof(Vec3));
  return sum;
}

}  // namespace tendon::softbody
