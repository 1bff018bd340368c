// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/effects/cutting.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/softbody/fem/groups.h"
#include "clients/softbody/fem/hold.h"

namespace tendon::softbody {
namespace {

/// Relative to the distance between two centers. A center that is this close to the plane is on its far side.
constexpr double kOnPlane = 1e-6;

bool between(const Cut& cut, const Vec3& from, const Vec3& to) {
  const Vec3 normal = cut.along.cross(cut.deep);
  const double least = kOnPlane * normal.norm() * (to - from).norm();
  const double before = normal.dot(from - cut.corner) + least;
  const double after = normal.dot(to - cut.corner) + least;
  if ((before > 0) == (after > 0)) return false;
  const Vec3 place = from + before / (before - after) * (to - from) - cut.corner;
  const double s = place.cross(cut.deep).dot(normal) / normal.squaredNorm();
  const double t = cut.along.cross(place).dot(normal) / normal.squaredNorm();
  return s >= -kOnPlane && s <= 1 + kOnPlane && t >= -kOnPlane && t <= 1 + kOnPlane;
}

/// Copies the nodes of opened faces. Elements that share an unopened face keep sharing their nodes.
void part_nodes(const Mesh& mesh, std::span<const Cut> cuts, const Fixed& fixed, Division& to) {
  const int per = nodes_of(mesh.shape);
  const auto place_of = [&](int element, int node) {
    const auto nodes = mesh.element(element);
    return element * per + static_cast<int>(std::ranges::find(nodes, node) - nodes.begin());
  };
  Groups places(mesh.elements.size());
  std::vector<bool> on_cut(mesh.nodes.size());
  for (const auto& [face, opposite] : inner_faces(mesh)) {
    const Vec3 from = middle(mesh, face.element);
    const Vec3 to_there = middle(mesh, opposite.element);
    const bool open = std::ranges::any_of(cuts, [&](const Cut& cut) { return between(cut, from, to_there); });
    to.opened += open ? 1 : 0;
    for (const int node : nodes_on(mesh, face)) {
      if (open) on_cut[at(node)] = true;
      if (!open) places.unite(place_of(face.element, node), place_of(opposite.element, node));
    }
  }
  std::vector<int> first(mesh.nodes.size(), -1);
  std::vector<int> number_of(mesh.elements.size(), -1);
  to.mesh = mesh;
  to.fixed = fixed;
  to.element_before.resize(at(mesh.element_count()));
  std::iota(to.element_before.begin(), to.element_before.end(), 0);
  to.node_before.resize(mesh.nodes.size());
  std::iota(to.node_before.begin(), to.node_before.end(), 0);
  for (std::size_t i = 0; i < mesh.elements.size(); ++i) {
    const int node = mesh.elements[i];
    if (!on_cut[at(node)]) continue;
    const int group = places.find(static_cast<int>(i));
    if (first[at(node)] < 0) {
      first[at(node)] = group;
      number_of[at(group)] = node;
    }
    int& number = number_of[at(group)];
    if (number < 0) {
      number = static_cast<int>(to.mesh.nodes.size());
      to.mesh.nodes.push_back(mesh.nodes[at(node)]);
      to.node_before.push_back(node);
      for (int c = 0; c < 3; ++c) to.fixed.push_back(fixed[at(3 * node + c)]);
    }
    to.mesh.elements[i] = number;
  }
}

/// Removes pieces without three fixed nodes that are not collinear.
void drop_loose(Division& to) {
  Mesh& mesh = to.mesh;
  Groups pieces(mesh.nodes.size());
  for (int e = 0; e < mesh.element_count(); ++e) {
    for (const int node : mesh.element(e)) pieces.unite(mesh.element(e).front(), node);
  }
  std::vector<Hold> holds(mesh.nodes.size());
  for (int node = 0; node < static_cast<int>(mesh.nodes.size()); ++node) {
    if (!to.fixed[at(3 * node)] || !to.fixed[at(3 * node + 1)] || !to.fixed[at(3 * node + 2)]) continue;
    holds[at(pieces.find(node))].add(mesh.nodes[at(node)]);
  }
  std::vector<int> kept;
  std::vector<int> kept_before;
  std::vector<bool> used(mesh.nodes.size());
  for (int e = 0; e < mesh.element_count(); ++e) {
    const auto nodes = mesh.element(e);
    if (!holds[at(pieces.find(nodes.front()))].fast()) {
      ++to.lost;
      continue;
    }
    kept.insert(kept.end(), nodes.begin(), nodes.end());
    kept_before.push_back(to.element_before[at(e)]);
    for (const int node : nodes) used[at(node)] = true;
  }
  if (to.lost == 0) return;
  mesh.elements = std::move(kept);
  to.element_before = std::move(kept_before);
  for (std::size_t i = 0; i < to.fixed.size(); ++i) to.fixed[i] = to.fixed[i] || !used[i / 3];
}

}  // namespace

Division divide(const Mesh& mesh, const Fixed& fixed, std::span<const Cut> cuts) {
  Division division;
  part_nodes(mesh, cuts, fixed, division);
  drop_loose(division);
  return division;
}

std::vector<int> twins(const Elastic& divided, const Division& division) {
  std::vector<int> twin_of;
  const int nodes = static_cast<int>(division.node_before.size());
  for (int node = 0; node < nodes; ++node) {
    if (division.node_before[at(node)] == node) continue;
    for (int c = 0; c < 3; ++c) {
      if (divided.free_of(3 * node + c) >= 0) {
        twin_of.push_back(divided.free_of(3 * division.node_before[at(node)] + c));
      }
    }
  }
  return twin_of;
}

Cutting::Cutting(std::vector<PlannedCut> plan) : plan_(std::move(plan)) {
  for (std::size_t i = 0; i < plan_.size(); ++i) {
    const auto refuse = [&](const std::string& what) {
      throw std::invalid_argument("cutting: cut " + std::to_string(i + 1) + what);
    };
    const Cut& cut = plan_[i].cut;
    if (!cut.corner.allFinite() || !(cut.along.cross(cut.deep).norm() > 0) ||
        !std::isfinite(cut.along.cross(cut.deep).norm())) {
      refuse(" has no area");
    }
    const bool timed = plan_[i].when == PlannedCut::When::kTime;
    if (timed && !(plan_[i].value >= 0)) refuse(": expected a time of 0 or more");
    if (!timed && !(plan_[i].value > 0)) refuse(": expected a force above 0");
  }
  made_.reserve(plan_.size());
}

bool Cutting::due(PlannedCut::When when, double value) const noexcept {
  if (left() == 0 || plan_[made_.size()].when != when) return false;
  const double wanted = plan_[made_.size()].value;
  return when == PlannedCut::When::kTime ? value >= wanted : value > wanted;
}

std::span<const Cut> Cutting::make_next() {
  made_.push_back(plan_[made_.size()].cut);
  changed_ = true;
  return made_;
}

std::vector<Cut> Cutting::with_next() const {
  std::vector<Cut> all = made_;
  all.push_back(plan_[made_.size()].cut);
  return all;
}

bool Cutting::take_changed() noexcept { return std::exchange(changed_, false); }

std::size_t Cutting::bytes() const noexcept {
  return sizeof *this + plan_.size() * sizeof(PlannedCut) + made_.capacity() * sizeof(Cut);
}

}  // namespace tendon::softbody
