// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/models/modal.h"

#include <stdexcept>

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/models/linear.h"
#include "tests/tools/lab/models/spectrum.h"

namespace tendon::softbody::compared {
namespace {

/// A shape is linearly dependent if its residual has at most this fraction of its elastic energy.
constexpr double kNew = 1e-6;

}  // namespace

ModalModel::ModalModel(const Solid& solid, const TouchSurface& surface, const Config& config)
    : row_of_(solid.mesh().nodes.size(), -1), glides_(config.glides) {
  LinearModel linear(solid, surface);
  SymmetricMatrix stiffness = solid.pattern();
  solid.stiffness(VectorXd::Zero(solid.size()), Elastic::Curvature::kExact, stiffness);
  const Swings swings = slowest_swings(stiffness, lumped_mass(solid, 1), config.swings);
  MatrixXd shapes = swings.shapes * swings.squares.cwiseSqrt().cwiseInverse().asDiagonal();  // xᵀ K x = 1
  for (const Vec2& middle : config.patches) {
    const auto patch = surface.patch(middle);
    if (!patch) throw std::invalid_argument("the patch of a static mode is not on the body");
    // Gram-Schmidt; the second pass removes rounding errors of the first.
    VectorXd shape = linear.displacements(*patch);
    shape /= std::sqrt(shape.dot(stiffness.times(shape)));
    for (int i = 0; i < 2; ++i) shape -= shapes * (shapes.transpose() * stiffness.times(shape));
    const double energy = shape.dot(stiffness.times(shape));
    if (energy < kNew) continue;
    shapes.conservativeResize(Eigen::NoChange, shapes.cols() + 1);
    shapes.rightCols(1) = shape / std::sqrt(energy);
  }
  surface_.resize(static_cast<Eigen::Index>(surface.nodes().size()), shapes.cols());
  for (Eigen::Index mode = 0; mode < shapes.cols(); ++mode) {
    VectorXd all = VectorXd::Zero(solid.size());
    solid.add_free(shapes.col(mode), all);
    for (std::size_t i = 0; i < surface.nodes().size(); ++i) {
      surface_(static_cast<Eigen::Index>(i), mode) = -surface.normal().dot(all.segment<3>(3 * surface.nodes()[i]));
    }
  }
  for (std::size_t i = 0; i < surface.nodes().size(); ++i) row_of_[at(surface.nodes()[i])] = static_cast<int>(i);
}

Reaction ModalModel::press(const Patch& patch, Prescribed given, double value) {
  VectorXd shares = VectorXd::Zero(surface_.cols());  // modal coordinates under 1 N
  for (Eigen::Index i = 0; i < patch.weights.size(); ++i) {
    shares += patch.weights[i] * surface_.row(row_of_[at(patch.nodes[static_cast<std::size_t>(i)])]);
  }
  VectorXd depth(patch.weights.size());
  for (Eigen::Index i = 0; i < depth.size(); ++i) {
    depth[i] = surface_.row(row_of_[at(patch.nodes[static_cast<std::size_t>(i)])]) * shares;
  }
  Reaction reaction = linear_reaction(patch, depth, given, value);
  if (patch.curvatures.size() > 0) {
    // Derivatives of `shares` with respect to the slopes of the load.
    MatrixXd tilted = MatrixXd::Zero(surface_.cols(), 2);
    for (Eigen::Index i = 0; i < depth.size(); ++i) {
      tilted += surface_.row(row_of_[at(patch.nodes[static_cast<std::size_t>(i)])]).transpose() *
                patch.slopes.col(i).transpose();
    }
    add_glide(patch, depth, tilted.transpose() * tilted, reaction);
  }
  return reaction;
}

std::size_t ModalModel::bytes() const noexcept {
  return row_of_.size() * sizeof(int) + static_cast<std::size_t>(surface_.size()) * sizeof(double);
}

}  // namespace tendon::softbody::compared
