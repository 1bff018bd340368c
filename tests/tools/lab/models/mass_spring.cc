// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/models/mass_spring.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <map>
#include <stdexcept>
#include <utility>

namespace tendon::softbody::compared {
namespace {

/// A spring with less relative length has no direction.
constexpr double kShortest = 1e-9;

std::vector<double> factors_of(const Solid& solid) {
  std::vector<double> factors;
  for (const Material& each : solid.of_elements()) factors.push_back(each.young / solid.material().young);
  return factors;
}

}  // namespace

SpringNet::SpringNet(const Mesh& at_rest, double young, const Fixed& fixed, const std::vector<double>& factors)
    : Elastic(at_rest, fixed) {
  if (mesh().shape != Shape::kTet4) throw std::invalid_argument("a spring network requires a mesh of tetrahedra");
  std::map<std::pair<int, int>, double> volumes;  // the volumes around each edge, multiplied by the factors
  for (int e = 0; e < mesh().element_count(); ++e) {
    const auto nodes = mesh().element(e);
    Mat3 edges;
    for (int i = 0; i < 3; ++i) edges.col(i) = mesh().nodes[at(nodes[at(i + 1)])] - mesh().nodes[at(nodes[0])];
    const double volume = edges.determinant() / 6 * (factors.empty() ? 1 : factors[at(e)]);
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < i; ++j) volumes[std::minmax(nodes[i], nodes[j])] += volume;
    }
  }
  for (const auto& [edge, volume] : volumes) {
    const double length = (mesh().nodes[at(edge.second)] - mesh().nodes[at(edge.first)]).norm();
    springs_.push_back({edge.first, edge.second, length, young * volume / (length * length)});
    const std::array<int, 2> ends{edge.first, edge.second};
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t i = 0; i < 6; ++i) {
        slots_.push_back(slot(3 * ends[i / 3] + static_cast<int>(i % 3), 3 * ends[j / 3] + static_cast<int>(j % 3)));
      }
    }
  }
}

Vec3 SpringNet::along(const Spring& spring, const VectorXd& u) const {
  return mesh().nodes[at(spring.b)] + u.segment<3>(3 * spring.b) - mesh().nodes[at(spring.a)] -
         u.segment<3>(3 * spring.a);
}

double SpringNet::energy(const VectorXd& u) const {
  double sum = 0;
  for (const Spring& spring : springs_) {
    const double longer = along(spring, u).norm() - spring.length;
    sum += 0.5 * spring.stiffness * longer * longer;
  }
  return sum;
}

Elastic::Forces SpringNet::forces(const VectorXd& u) const {
  Forces all{0, VectorXd::Zero(size())};
  for (const Spring& spring : springs_) {
    const Vec3 x = along(spring, u);
    const double length = std::max(x.norm(), kShortest * spring.length);
    const double longer = length - spring.length;
    all.energy += 0.5 * spring.stiffness * longer * longer;
    const Vec3 pull = spring.stiffness * longer / length * x;
    all.force.segment<3>(3 * spring.b) += pull;
    all.force.segment<3>(3 * spring.a) -= pull;
  }
  return all;
}

void SpringNet::stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const {
  std::ranges::fill(to.values, 0.0);
  auto slot = slots_.begin();
  for (const Spring& spring : springs_) {
    const Vec3 x = along(spring, u);
    const double length = std::max(x.norm(), kShortest * spring.length);
    const Vec3 way = x / length;
    double across = 1 - spring.length / length;  // negative: a compressed spring buckles sideways
    if (curvature == Curvature::kWithoutNegative) across = std::max(0.0, across);
    const Mat3 k = spring.stiffness * ((1 - across) * way * way.transpose() + across * Mat3::Identity());
    for (int j = 0; j < 6; ++j) {
      for (int i = 0; i < 6; ++i, ++slot) {
        if (*slot >= 0) to.values[at(*slot)] += (i / 3 == j / 3 ? 1 : -1) * k(i % 3, j % 3);
      }
    }
  }
}

std::size_t SpringNet::bytes() const noexcept {
  return mesh_bytes() + springs_.size() * sizeof(Spring) + slots_.size() * sizeof(int);
}

MassSpringModel::MassSpringModel(const Solid& solid, const TouchSurface& surface,
                                 const QuasiStaticModel::Config& config, const EffectsConfig& effects)
    : springs_(solid.mesh(), solid.material().young, solid.fixed(), factors_of(solid)),
      newton_(springs_, surface, config, effects) {}

}  // namespace tendon::softbody::compared
