// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/solid.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace tendon::softbody {

Solid::Solid(Mesh at_rest, Element element, const Material& material, Law law, const Fixed& fixed,
             std::vector<Material> of_elements)
    : Elastic(std::move(at_rest), fixed),
      element_(element),
      material_(material),
      of_elements_(std::move(of_elements)),
      law_(law),
      per_element_(static_cast<int>(quadrature(element).size())),
      kernel_(law, nodes_of(mesh().shape), per_element_) {
  softbody::check(material);
  for (const Material& each : of_elements_) softbody::check(each);
  if (!of_elements_.empty() && of_elements_.size() != at(mesh().element_count())) {
    throw std::invalid_argument("of_elements: expected a material for each element, or none");
  }
  if (info(element).shape != mesh().shape) {
    throw std::invalid_argument("the mesh has no elements of the kind " + std::string(info(element).name));
  }
  for (int e = 0; e < mesh().element_count(); ++e) place(e);
  connect();
}

void Solid::place(int element) {
  const auto nodes = mesh().element(element);
  const Material& material = this->material(element);
  kernel_.add_element(nodes);
  for (int q = 0; q < per_element_; ++q) {
    const QuadraturePoint& point = quadrature(element_)[at(q)];
    const ShapeValues shape = shape_at(mesh().shape, point.at);
    Mat3 jacobian = Mat3::Zero();
    for (int i = 0; i < shape.value.size(); ++i) {
      jacobian += mesh().nodes[at(nodes[at(i)])] * shape.gradient.col(i).transpose();
    }
    const Point& placed = points_.emplace_back(
        Point{point.weight * jacobian.determinant(), point.mu * material.mu(), point.lambda * material.lambda()});
    const Nodal gradient = jacobian.inverse().transpose() * shape.gradient;
    kernel_.set_point(element, q, gradient, placed.volume * placed.mu, placed.volume * placed.lambda);
  }
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

Solid::Forces Solid::forces(const VectorXd& u) const {
  Forces all{0, VectorXd::Zero(size())};
  all.energy = kernel_.add_forces(u, all.force);
  return all;
}

void Solid::stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const {
  const auto tangent_at = [&](int element, int index, const Mat3& f) -> Mat9 {
    const Point& here = point(element, index);
    const Mat9 exact = tangent(law_, f, here.mu, here.lambda);
    return curvature == Curvature::kExact ? exact : without_negative(exact);
  };
  sum_stiffness(u, tangent_at, to);
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

double Solid::largest_poisson() const {
  double largest = material_.poisson;
  for (const Material& each : of_elements_) largest = std::max(largest, each.poisson);
  return largest;
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
         of_elements_.size() * sizeof(Material) + kernel_.bytes();
}

}  // namespace tendon::softbody
