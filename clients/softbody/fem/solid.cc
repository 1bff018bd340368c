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
      per_element_(static_cast<int>(quadrature(element).size())) {
  softbody::check(material);
  for (const Material& each : of_elements_) softbody::check(each);
  if (!of_elements_.empty() && of_elements_.size() != at(mesh().element_count())) {
    throw std::invalid_argument("of_elements: expected a material for each element, or none");
  }
  if (info(element).shape != mesh().shape) {
    throw std::invalid_argument("the mesh has no elements of the type " + std::string(info(element).name));
  }
}

Solid::Solid(Mesh at_rest, const Solid& whole, const Fixed& fixed, std::vector<Material> of_elements)
    : Elastic(std::move(at_rest), fixed, Together{}),
      element_(whole.element_),
      material_(whole.material_),
      of_elements_(std::move(of_elements)),
      law_(whole.law_),
      per_element_(whole.per_element_) {}

Solid Solid::part_of(const Solid& whole, const std::vector<int>& elements, std::vector<int>& nodes) {
  const Mesh& all = whole.mesh();
  std::vector<int> own(all.nodes.size(), -1);
  for (const int element : elements) {
    for (const int node : all.element(element)) own[at(node)] = 0;
  }
  Mesh mesh{.shape = all.shape, .nodes = {}, .elements = {}};
  Fixed fixed;
  nodes.clear();
  for (std::size_t i = 0; i < own.size(); ++i) {
    if (own[i] < 0) continue;
    own[i] = static_cast<int>(nodes.size());
    nodes.push_back(static_cast<int>(i));
    mesh.nodes.push_back(all.nodes[i]);
    for (int c = 0; c < 3; ++c) fixed.push_back(whole.free_of(3 * nodes.back() + c) < 0);
  }
  for (const int element : elements) {
    for (const int node : all.element(element)) mesh.elements.push_back(own[at(node)]);
  }
  std::vector<Material> of_elements;
  for (const int element : elements) {
    if (!whole.of_elements_.empty()) of_elements.push_back(whole.material(element));
  }
  return {std::move(mesh), whole, fixed, std::move(of_elements)};
}

Solid::Part Solid::part(int element, int index) const {
  const auto nodes = mesh().element(element);
  const QuadraturePoint& point = quadrature(element_)[at(index)];
  const ShapeValues shape = shape_at(mesh().shape, point.at);
  Mat3 jacobian = Mat3::Zero();
  for (int i = 0; i < shape.value.size(); ++i) {
    jacobian += mesh().nodes[at(nodes[at(i)])] * shape.gradient.col(i).transpose();
  }
  const Material& material = this->material(element);
  return {{point.weight * jacobian.determinant(), point.mu * material.mu(), point.lambda * material.lambda()},
          jacobian.inverse().transpose() * shape.gradient};
}

const Solid::Parts& Solid::make_parts() const {
  return parts_.get([this] {
    Parts all{{}, Kernel(law_, nodes_of(mesh().shape), per_element_)};
    all.points.reserve(at(mesh().element_count()) * at(per_element_));
    for (int e = 0; e < mesh().element_count(); ++e) {
      all.kernel.add_element(mesh().element(e));
      for (int q = 0; q < per_element_; ++q) {
        const Part here = part(e, q);
        const Point& point = all.points.emplace_back(here.point);
        all.kernel.set_point(e, q, here.gradient, point.volume * point.mu, point.volume * point.lambda);
      }
    }
    return all;
  });
}

const std::vector<int>& Solid::slots() const {
  return slots_.get([this] {
    std::vector<int> slots;
    const int nodes = nodes_of(mesh().shape);
    slots.reserve(at(mesh().element_count()) * at(9 * nodes * nodes));
    for (int e = 0; e < mesh().element_count(); ++e) {
      const auto element = mesh().element(e);
      for (int j = 0; j < 3 * nodes; ++j) {
        for (int i = 0; i < 3 * nodes; ++i) {
          slots.push_back(slot(3 * element[at(i / 3)] + i % 3, 3 * element[at(j / 3)] + j % 3));
        }
      }
    }
    return slots;
  });
}

Solid::Nodal Solid::displacements(const VectorXd& u, int element) const {
  const auto nodes = mesh().element(element);
  Nodal local(3, static_cast<Eigen::Index>(nodes.size()));
  for (int i = 0; i < local.cols(); ++i) local.col(i) = u.segment<3>(3 * nodes[at(i)]);
  return local;
}

Solid::Forces Solid::forces(const VectorXd& u) const {
  Forces all{0, VectorXd::Zero(size())};
  all.energy = parts().kernel.add_forces(u, all.force);
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
  std::size_t sum = mesh_bytes() + of_elements_.size() * sizeof(Material);
  if (const std::vector<int>* const slots = slots_.made()) sum += slots->size() * sizeof(int);
  if (const Parts* const parts = parts_.made()) sum += parts->points.size() * sizeof(Point) + parts->kernel.bytes();
  return sum;
}

}  // namespace tendon::softbody
