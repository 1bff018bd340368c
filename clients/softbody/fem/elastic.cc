// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/elastic.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

namespace tendon::softbody {

Elastic::Elastic(Mesh mesh, const Fixed& fixed) : Elastic(std::move(mesh), fixed, Together{}) {
  if (free_count() == size()) {
    throw std::invalid_argument("the body is not fixed: expected some fixed nodes");
  }
}

Elastic::Elastic(Mesh mesh, const Fixed& fixed, Together together)
    : mesh_(std::move(mesh)), together_(std::move(together)) {
  check(mesh_, "mesh");
  if (fixed.size() != 3 * mesh_.nodes.size()) throw std::invalid_argument("fixed: expected 3 for each node");
  for (std::size_t i = 0; i < fixed.size() + at(together_.count); ++i) {
    const bool free = i >= fixed.size() || !fixed[i];
    free_of_.push_back(free ? static_cast<int>(all_of_.size()) : -1);
    if (free) all_of_.push_back(static_cast<int>(i));
  }
}

const SymmetricMatrix& Elastic::pattern() const {
  return pattern_.get([this] {
    SymmetricMatrix pattern;
    std::vector<std::vector<int>> near(mesh_.nodes.size());
    for (int e = 0; e < mesh_.element_count(); ++e) {
      for (const int a : mesh_.element(e)) {
        near[at(a)].insert(near[at(a)].end(), mesh_.element(e).begin(), mesh_.element(e).end());
      }
    }
    for (auto& list : near) {
      std::ranges::sort(list);
      list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    std::vector<bool> on_rim(mesh_.nodes.size());
    for (const int node : together_.rim) on_rim[at(node)] = true;
    pattern.size = free_count();
    pattern.column_starts.push_back(0);
    const int of_nodes = free_count() - together_.count;
    for (int column = 0; column < free_count(); ++column) {
      bool beside_rim = column >= of_nodes;
      if (column < of_nodes) {
        for (const int node : near[at(all_of_[at(column)] / 3)]) {
          beside_rim = beside_rim || on_rim[at(node)];
          for (int c = 0; c < 3; ++c) {
            const int row = free_of_[at(3 * node + c)];
            if (row >= column) pattern.rows.push_back(row);
          }
        }
      }
      for (int row = std::max(column, of_nodes); beside_rim && row < free_count(); ++row) pattern.rows.push_back(row);
      pattern.column_starts.push_back(static_cast<int>(pattern.rows.size()));
    }
    pattern.values.assign(pattern.rows.size(), 0);
    return pattern;
  });
}

SymmetricMatrix Elastic::exact_stiffness(const VectorXd& u) const {
  SymmetricMatrix matrix = pattern();
  stiffness(u, Curvature::kExact, matrix);
  return matrix;
}

int Elastic::slot(int row_component, int column_component) const {
  const int row = free_of(row_component);
  const int column = free_of(column_component);
  return column < 0 || row < column ? -1 : pattern().slot(row, column);
}

Fixed Elastic::fixed() const {
  Fixed fixed(free_of_.size());
  for (std::size_t i = 0; i < fixed.size(); ++i) fixed[i] = free_of_[i] < 0;
  return fixed;
}

VectorXd Elastic::to_free(const VectorXd& all) const {
  VectorXd free(free_count());
  for (int i = 0; i < free_count(); ++i) free[i] = all[all_of_[at(i)]];
  return free;
}

void Elastic::add_free(const VectorXd& free, VectorXd& all) const {
  for (int i = 0; i < free_count(); ++i) all[all_of_[at(i)]] += free[i];
}

std::size_t Elastic::mesh_bytes() const noexcept {
  return mesh_.nodes.size() * sizeof(Vec3) + mesh_.elements.size() * sizeof(int) +
         (free_of_.size() + all_of_.size()) * sizeof(int) + (pattern_.made() != nullptr ? pattern_.made()->bytes() : 0);
}

VectorXd lumped_mass(const Elastic& elastic, double density) {
  const std::vector<double> volumes = nodal_volumes(elastic.mesh());
  VectorXd all(elastic.size());
  for (int i = 0; i < elastic.size(); ++i) all[i] = density * volumes[at(i / 3)];
  return elastic.to_free(all);
}

Factor factor_of(const SymmetricMatrix& stiffness) {
  Factor factor(stiffness);
  if (!factor.factorize(stiffness)) {
    throw std::runtime_error("the body can still move as a whole: expected more fixed nodes");
  }
  return factor;
}

Vec3 place_of(const Mesh& mesh, const Patch& patch) {
  Vec3 place = Vec3::Zero();
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    place += patch.weights[i] * mesh.nodes[at(patch.nodes[static_cast<std::size_t>(i)])];
  }
  return place;
}

VectorXd patch_load(const Elastic& elastic, const Vec3& normal, const Patch& patch) {
  VectorXd all = VectorXd::Zero(elastic.size());
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    all.segment<3>(3 * patch.nodes[static_cast<std::size_t>(i)]) = -patch.weights[i] * normal;
  }
  return all;
}

MatrixXd patch_load_slopes(const Elastic& elastic, const Vec3& normal, const Patch& patch) {
  MatrixXd all = MatrixXd::Zero(elastic.size(), 2);
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    const int node = patch.nodes[static_cast<std::size_t>(i)];
    all.middleRows<3>(3 * node) = -normal * patch.slopes.col(i).transpose();
  }
  return all;
}

double depth_below(const Patch& patch, const Vec3& normal, const VectorXd& u) {
  double depth = 0;
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    depth -= patch.weights[i] * normal.dot(u.segment<3>(3 * patch.nodes[static_cast<std::size_t>(i)]));
  }
  return depth;
}

Vec2 slope_below(const Patch& patch, const Vec3& normal, const VectorXd& u) {
  Vec2 slope = Vec2::Zero();
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    slope -= patch.slopes.col(i) * normal.dot(u.segment<3>(3 * patch.nodes[static_cast<std::size_t>(i)]));
  }
  return slope;
}

Mat2 curve_below(const Patch& patch, const Vec3& normal, const VectorXd& u) {
  Vec3 curve = Vec3::Zero();
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    curve -= patch.curvatures.col(i) * normal.dot(u.segment<3>(3 * patch.nodes[static_cast<std::size_t>(i)]));
  }
  return (Mat2() << curve[0], curve[1], curve[1], curve[2]).finished();
}

}  // namespace tendon::softbody
