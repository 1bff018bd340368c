// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/plasticity.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

/// A lower limit, because two stretches of an inverted element may cancel. The usual value is about 2.
constexpr double kLeastSum = 0.02;

Mat3 sym(const Mat3& a) { return 0.5 * (a + a.transpose()); }

Mat3 deviator(const Mat3& a) { return a - a.trace() / 3 * Mat3::Identity(); }

/// The stretch S of F = R S. share() maps a change Y of FᵀF = S² to the change X of S: S X + X S = Y.
class Stretch {
 public:
  explicit Stretch(const Mat3& f) : stretch_(sym(nearest_rotation(f).transpose() * f)), axes_(stretch_) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        sums_(i, j) = std::max(kLeastSum, axes_.eigenvalues()[i] + axes_.eigenvalues()[j]);
      }
    }
  }

  Mat3 strain() const { return stretch_ - Mat3::Identity(); }

  Mat3 share(const Mat3& y) const {
    const Mat3& q = axes_.eigenvectors();
    return q * (q.transpose() * y * q).cwiseQuotient(sums_) * q.transpose();
  }

 private:
  Mat3 stretch_;
  Eigen::SelfAdjointEigenSolver<Mat3> axes_;
  Mat3 sums_;
};

}  // namespace

void check(const Yield& yield) {
  expect_above_zero(yield.stress, "plasticity.yield");
  expect_above_zero(yield.hardening, "plasticity.hardening");
}

struct PlasticSolid::Flow {
  Mat3 plastic;
  double lost = 0;    ///< J/m³
  Mat3 way;           ///< direction of p − p₀
  double onward = 0;  ///< ∂p/∂ε along and across `way`
  double sideways = 0;

  Mat3 change(const Mat3& strain) const {
    const Mat3 all = deviator(strain);
    const double along = way.cwiseProduct(all).sum();
    return onward * along * way + sideways * (all - along * way);
  }
};

PlasticSolid::PlasticSolid(const Solid& solid, const Yield& yield)
    : Solid(solid), yield_(yield), plastic_(at(mesh().element_count() * points_per_element()), Mat3::Zero()) {
  check(yield);
  if (law() != Law::kLinear && law() != Law::kCorotational) {
    throw std::invalid_argument("plasticity requires the linear or the corotational law");
  }
}

PlasticSolid::Flow PlasticSolid::flow(int element, int point, const Mat3& strain) const {
  const double mu = this->point(element, point).mu;
  const double harder = 2 * yield_.hardening / 3;
  const double radius = std::sqrt(2.0 / 3) * yield_.stress;
  Flow flow{.plastic = plastic_strain(element, point), .way = Mat3::Zero()};
  if (mu == 0) return flow;
  const Mat3 trial = 2 * mu * (deviator(strain) - flow.plastic) - harder * flow.plastic;
  const double size = trial.norm();
  if (size <= radius) return flow;
  const double more = (size - radius) / (2 * mu + harder);
  flow.way = trial / size;
  flow.plastic += more * flow.way;
  flow.lost = radius * more;
  flow.onward = 2 * mu / (2 * mu + harder);
  flow.sideways = 2 * mu * more / size;
  return flow;
}

Stress PlasticSolid::flow_at(int element, int point, const Mat3& f) const {
  const double mu = this->point(element, point).mu;
  const auto energy = [&](const Flow& flow, const Mat3& strain) {
    const Mat3& p = flow.plastic;
    return -2 * mu * p.cwiseProduct(strain).sum() + (mu + yield_.hardening / 3) * p.squaredNorm() + flow.lost;
  };
  if (law() == Law::kLinear) {
    const Mat3 strain = sym(f) - Mat3::Identity();
    const Flow step = flow(element, point, strain);
    return {energy(step, strain), -2 * mu * step.plastic};
  }
  const Stretch stretch(f);
  const Flow step = flow(element, point, stretch.strain());
  return {energy(step, stretch.strain()), -4 * mu * f * stretch.share(step.plastic)};
}

Mat9 PlasticSolid::tangent_at(int element, int point, const Mat3& f) const {
  const Point& here = this->point(element, point);
  Mat9 all = tangent(law(), f, here.mu, here.lambda);
  if (law() == Law::kLinear) {
    const Flow step = flow(element, point, sym(f) - Mat3::Identity());
    if (step.plastic.isZero(0)) return all;
    return all - by_columns([&](const Mat3& df) -> Mat3 { return 2 * here.mu * step.change(sym(df)); });
  }
  const Stretch stretch(f);
  const Flow step = flow(element, point, stretch.strain());
  if (step.plastic.isZero(0)) return all;
  // With Z = share(p):  d(2 F Z) = 2 dF Z + 2 F share(dp − Z dS − dS Z), from the second derivative of S S = FᵀF.
  const Mat3 z = stretch.share(step.plastic);
  return all - by_columns([&](const Mat3& df) -> Mat3 {
           const Mat3 ds = stretch.share(df.transpose() * f + f.transpose() * df);
           return 4 * here.mu * (df * z + f * stretch.share(step.change(ds) - z * ds - ds * z));
         });
}

Solid::Forces PlasticSolid::forces(const VectorXd& u) const {
  Forces all = Solid::forces(u);
  for (int e = 0; e < mesh().element_count(); ++e) {
    const Nodal local = displacements(u, e);
    const auto nodes = mesh().element(e);
    for (int q = 0; q < points_per_element(); ++q) {
      const Point& here = point(e, q);
      if (here.mu == 0) continue;
      const auto g = gradient(e, q);
      const Stress flow = flow_at(e, q, Mat3::Identity() + local * g.transpose());
      if (flow.energy == 0 && flow.piola.isZero(0)) continue;
      all.energy += here.volume * flow.energy;
      const Nodal force = here.volume * flow.piola * g;
      for (int i = 0; i < force.cols(); ++i) all.force.segment<3>(3 * nodes[at(i)]) += force.col(i);
    }
  }
  return all;
}

void PlasticSolid::stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const {
  const auto here = [&](int element, int point, const Mat3& f) -> Mat9 {
    const Mat9 exact = tangent_at(element, point, f);
    return curvature == Curvature::kExact ? exact : without_negative(exact);
  };
  sum_stiffness(u, here, to);
}

void PlasticSolid::advance(const VectorXd& u) {
  for (int e = 0; e < mesh().element_count(); ++e) {
    const Nodal local = displacements(u, e);
    for (int q = 0; q < points_per_element(); ++q) {
      const Mat3 f = Mat3::Identity() + local * gradient(e, q).transpose();
      const Flow step = flow(e, q, law() == Law::kLinear ? Mat3(sym(f) - Mat3::Identity()) : Stretch(f).strain());
      yielded_ = yielded_ || step.lost > 0;
      plastic_[at(e * points_per_element() + q)] = step.plastic;
    }
  }
}

std::size_t PlasticSolid::bytes() const noexcept { return Solid::bytes() + plastic_.size() * sizeof(Mat3); }

PlasticModel::PlasticModel(const Solid& solid, const TouchSurface& surface, const QuasiStaticModel::Config& config,
                           const EffectsConfig& effects, const Yield& yield)
    : solid_(solid, yield), model_(solid_, surface, config, effects) {
  solid_.advance(model_.displacements());
  model_.forget_forces();
}

Reaction PlasticModel::press(const Patch& patch, Prescribed given, double value) {
  const Reaction reaction = model_.press(patch, given, value);
  solid_.advance(model_.displacements());
  model_.forget_forces();
  return reaction;
}

}  // namespace tendon::softbody
