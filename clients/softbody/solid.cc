// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/solid.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace tendon::softbody {
namespace {

using ElementMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 3 * kMaxNodes, 3 * kMaxNodes>;

}  // namespace

Solid::Solid(Mesh at_rest, Element element, const Material& material, Law law, const Fixed& fixed)
    : Elastic(std::move(at_rest), fixed),
      element_(element),
      material_(material),
      law_(law),
      per_element_(static_cast<int>(quadrature(element).size())) {
  softbody::check(material);
  if (info(element).shape != mesh().shape) {
    throw std::invalid_argument("the mesh has no elements of the kind " + std::string(info(element).name));
  }
  for (int e = 0; e < mesh().element_count(); ++e) {
    for (const QuadraturePoint& point : quadrature(element_)) place(point, mesh().element(e));
  }
  connect();
}

void Solid::place(const QuadraturePoint& point, std::span<const int> nodes) {
  const ShapeValues shape = shape_at(mesh().shape, point.at);
  Mat3 jacobian = Mat3::Zero();
  for (int i = 0; i < shape.value.size(); ++i) {
    jacobian += mesh().nodes[at(nodes[at(i)])] * shape.gradient.col(i).transpose();
  }
  points_.push_back(
      {point.weight * jacobian.determinant(), point.mu * material_.mu(), point.lambda * material_.lambda()});
  const Nodal gradient = jacobian.inverse().transpose() * shape.gradient;
  gradients_.insert(gradients_.end(), gradient.data(), gradient.data() + gradient.size());
}

void Solid::connect() {
  const int nodes = nodes_of(mesh().shape);
  for (int e = 0; e < mesh().element_count(); ++e) {
    const auto element = mesh().element(e);
    for (int j = 0; j < 3 * nodes; ++j) {
      for (int i = 0; i < 3 * nodes; ++i) {
        slots_.push_back(slot(3 * element[at(i / 3)] + i % 3, 3 * element[at(j / 3)] + j % 3));
      }
    }
  }
}

Solid::Nodal Solid::displacements(const VectorXd& u, int element) const {
  const auto nodes = mesh().element(element);
  Nodal local(3, static_cast<Eigen::Index>(nodes.size()));
  for (int i = 0; i < local.cols(); ++i) local.col(i) = u.segment<3>(3 * nodes[at(i)]);
  return local;
}

Eigen::Map<const Solid::Nodal> Solid::gradient(int element, int point) const {
  const int nodes = nodes_of(mesh().shape);
  return {gradients_.data() + static_cast<std::ptrdiff_t>(element * per_element_ + point) * 3 * nodes, 3, nodes};
}

double Solid::energy(const VectorXd& u) const {
  double sum = 0;
  for (int e = 0; e < mesh().element_count(); ++e) {
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
  for (int e = 0; e < mesh().element_count(); ++e) {
    const Nodal local = displacements(u, e);
    Nodal force = Nodal::Zero(3, local.cols());
    for (int q = 0; q < per_element_; ++q) {
      const Point& point = points_[at(e * per_element_ + q)];
      const auto g = gradient(e, q);
      const Stress here = stress(law_, Mat3::Identity() + local * g.transpose(), point.mu, point.lambda);
      all.energy += point.volume * here.energy;
      force += point.volume * here.piola * g;
    }
    const auto nodes = mesh().element(e);
    for (int i = 0; i < local.cols(); ++i) all.force.segment<3>(3 * nodes[at(i)]) += force.col(i);
  }
  return all;
}

void Solid::stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const {
  std::ranges::fill(to.values, 0.0);
  const int nodes = nodes_of(mesh().shape);
  ElementMatrix k(3 * nodes, 3 * nodes);
  auto slot = slots_.begin();
  for (int e = 0; e < mesh().element_count(); ++e) {
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
  for (int e = 0; e < mesh().element_count(); ++e) {
    const Nodal local = displacements(u, e);
    bool bad = false;
    for (int q = 0; q < per_element_; ++q) {
      bad = bad || (Mat3::Identity() + local * gradient(e, q).transpose()).determinant() <= 0;
    }
    count += bad ? 1 : 0;
  }
  return count;
}

double Solid::largest_turn(const VectorXd& u) const {
  double largest = 0;
  for (int e = 0; e < mesh().element_count(); ++e) {
    const Nodal local = displacements(u, e);
    for (int q = 0; q < per_element_; ++q) {
      const Mat3 turn = nearest_rotation(Mat3::Identity() + local * gradient(e, q).transpose());
      largest = std::max(largest, Eigen::AngleAxisd(turn).angle());
    }
  }
  return largest;
}

std::size_t Solid::bytes() const noexcept {
  return mesh_bytes() + slots_.size() * sizeof(int) + points_.size() * sizeof(Point) +
         gradients_.size() * sizeof(double);
}

}  // namespace tendon::softbody
