// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/solid.h"

#include <Eigen/LU>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace tendon::softbody {
namespace {

using ElementMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3 * kMaxNodes, 3 * kMaxNodes>;

}  // namespace

Solid::Solid(Mesh mesh, Element element, const Material& material, Law law, Fixed fixed)
    : mesh_(std::move(mesh)),
      element_(element),
      law_(law),
      mu_(material.mu()),
      lambda_(material.lambda()),
      per_element_(static_cast<int>(quadrature(element).size())) {
  softbody::check(material);
  softbody::check(mesh_, "mesh");
  if (info(element).shape != mesh_.shape) {
    throw std::invalid_argument("the mesh has no elements of the kind " + std::string(info(element).name));
  }
  if (fixed.size() != 3 * mesh_.nodes.size() || std::ranges::find(fixed, true) == fixed.end()) {
    throw std::invalid_argument("nothing holds the body: some of its nodes must be fixed");
  }
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    free_of_.push_back(fixed[i] ? -1 : static_cast<int>(all_of_.size()));
    if (!fixed[i]) all_of_.push_back(static_cast<int>(i));
  }
  for (int e = 0; e < mesh_.element_count(); ++e) {
    for (const QuadraturePoint& point : quadrature(element_)) place(point, mesh_.element(e));
  }
  connect();
}

void Solid::place(const QuadraturePoint& point, std::span<const int> nodes) {
  const ShapeValues shape = shape_at(mesh_.shape, point.at);
  Mat3 jacobian = Mat3::Zero();
  for (int i = 0; i < shape.value.size(); ++i) {
    jacobian += mesh_.nodes[at(nodes[at(i)])] * shape.gradient.col(i).transpose();
  }
  points_.push_back({point.weight * jacobian.determinant(), point.mu * mu_, point.lambda * lambda_});
  const Nodal gradient = jacobian.inverse().transpose() * shape.gradient;
  gradients_.insert(gradients_.end(), gradient.data(), gradient.data() + gradient.size());
}

void Solid::connect() {
  const int nodes = nodes_of(mesh_.shape);
  // Neighbours of each node, itself included.
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
  pattern_.size = free_count();
  pattern_.column_starts.push_back(0);
  for (int column = 0; column < free_count(); ++column) {
    for (const int node : near[at(all_of_[at(column)] / 3)]) {
      for (int c = 0; c < 3; ++c) {
        const int row = free_of_[at(3 * node + c)];
        if (row >= column) pattern_.rows.push_back(row);
      }
    }
    pattern_.column_starts.push_back(static_cast<int>(pattern_.rows.size()));
  }
  pattern_.values.assign(pattern_.rows.size(), 0);

  for (int e = 0; e < mesh_.element_count(); ++e) {
    const auto element = mesh_.element(e);
    for (int j = 0; j < 3 * nodes; ++j) {
      const int column = free_of_[at(3 * element[at(j / 3)] + j % 3)];
      for (int i = 0; i < 3 * nodes; ++i) {
        const int row = free_of_[at(3 * element[at(i / 3)] + i % 3)];
        if (column < 0 || row < column) {
          slots_.push_back(-1);
          continue;
        }
        const auto begin = pattern_.rows.begin() + pattern_.column_starts[at(column)];
        const auto end = pattern_.rows.begin() + pattern_.column_starts[at(column) + 1];
        slots_.push_back(static_cast<int>(std::lower_bound(begin, end, row) - pattern_.rows.begin()));
      }
    }
  }
}

int Solid::free_of(int component) const noexcept { return free_of_[at(component)]; }

VectorXd Solid::to_free(const VectorXd& all) const {
  VectorXd free(free_count());
  for (int i = 0; i < free_count(); ++i) free[i] = all[all_of_[at(i)]];
  return free;
}

void Solid::add_free(const VectorXd& free, VectorXd& all) const {
  for (int i = 0; i < free_count(); ++i) all[all_of_[at(i)]] += free[i];
}

Solid::Nodal Solid::displacements(const VectorXd& u, int element) const {
  const auto nodes = mesh_.element(element);
  Nodal local(3, static_cast<Eigen::Index>(nodes.size()));
  for (int i = 0; i < local.cols(); ++i) local.col(i) = u.segment<3>(3 * nodes[at(i)]);
  return local;
}

Eigen::Map<const Solid::Nodal> Solid::gradient(int element, int point) const {
  const int nodes = nodes_of(mesh_.shape);
  return {gradients_.data() + static_cast<std::ptrdiff_t>(element * per_element_ + point) * 3 * nodes, 3, nodes};
}

double Solid::energy(const VectorXd& u) const {
  double sum = 0;
  for (int e = 0; e < mesh_.element_count(); ++e) {
    const Nodal local = displacements(u, e);
    for (int q = 0; q < per_element_; ++q) {
      const Point& point = points_[at(e * per_element_ + q)];
      const Mat3 f = Mat3::Identity() + local * gradient(e, q).transpose();
      sum += point.volume * stress(law_, f, point.mu, point.lambda).energy;
    }
  }
  return sum;
}

Solid::Forces Solid::forces(const VectorXd& u) const {
  Forces all{0, VectorXd::Zero(size())};
  for (int e = 0; e < mesh_.element_count(); ++e) {
    const Nodal local = displacements(u, e);
    Nodal force = Nodal::Zero(3, local.cols());
    for (int q = 0; q < per_element_; ++q) {
      const Point& point = points_[at(e * per_element_ + q)];
      const auto g = gradient(e, q);
      const Stress here = stress(law_, Mat3::Identity() + local * g.transpose(), point.mu, point.lambda);
      all.energy += point.volume * here.energy;
      force += point.volume * here.piola * g;
    }
    const auto nodes = mesh_.element(e);
    for (int i = 0; i < local.cols(); ++i) all.force.segment<3>(3 * nodes[at(i)]) += force.col(i);
  }
  return all;
}

void Solid::stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const {
  std::ranges::fill(to.values, 0.0);
  const int nodes = nodes_of(mesh_.shape);
  ElementMatrix k(3 * nodes, 3 * nodes);
  auto slot = slots_.begin();
  for (int e = 0; e < mesh_.element_count(); ++e) {
    const Nodal local = displacements(u, e);
    k.setZero();
    for (int q = 0; q < per_element_; ++q) {
      const Point& point = points_[at(e * per_element_ + q)];
      const auto g = gradient(e, q);
      Mat9 a = point.volume * tangent(law_, Mat3::Identity() + local * g.transpose(), point.mu, point.lambda);
      if (curvature == Curvature::kWithoutNegative) a = without_negative(a);
      for (int j = 0; j < nodes; ++j) {
        Eigen::Matrix<double, 9, 3> strained = a.middleCols<3>(0) * g(0, j);
        strained += a.middleCols<3>(3) * g(1, j);
        strained += a.middleCols<3>(6) * g(2, j);
        for (int i = 0; i < nodes; ++i) {
          k.block<3, 3>(3 * i, 3 * j) += g(0, i) * strained.middleRows<3>(0) + g(1, i) * strained.middleRows<3>(3) +
                                         g(2, i) * strained.middleRows<3>(6);
        }
      }
    }
    for (const double entry : k.reshaped()) {
      if (*slot >= 0) to.values[at(*slot)] += entry;
      ++slot;
    }
  }
}

int Solid::inverted(const VectorXd& u) const {
  int count = 0;
  for (int e = 0; e < mesh_.element_count(); ++e) {
    const Nodal local = displacements(u, e);
    bool bad = false;
    for (int q = 0; q < per_element_; ++q) {
      bad = bad || (Mat3::Identity() + local * gradient(e, q).transpose()).determinant() <= 0;
    }
    count += bad ? 1 : 0;
  }
  return count;
}

std::size_t Solid::bytes() const noexcept {
  return mesh_.nodes.size() * sizeof(Vec3) + (mesh_.elements.size() + slots_.size()) * sizeof(int) +
         (free_of_.size() + all_of_.size()) * sizeof(int) + points_.size() * sizeof(Point) +
         gradients_.size() * sizeof(double) + pattern_.bytes();
}

}  // namespace tendon::softbody
