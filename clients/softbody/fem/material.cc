// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/material.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

Mat3 cofactor(const Mat3& f) {
  Mat3 c;
  c << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)), f.col(0).cross(f.col(1));
  return c;
}

Mat3 cofactor_change(const Mat3& f, const Mat3& df) {
  Mat3 c;
  c << df.col(1).cross(f.col(2)) + f.col(1).cross(df.col(2)), df.col(2).cross(f.col(0)) + f.col(2).cross(df.col(0)),
      df.col(0).cross(f.col(1)) + f.col(0).cross(df.col(1));
  return c;
}

Mat3 sym(const Mat3& a) { return 0.5 * (a + a.transpose()); }

Mat3 isotropic(const Mat3& strain, double mu, double lambda) {
  return 2 * mu * strain + lambda * strain.trace() * Mat3::Identity();
}

Mat9 corotational_tangent(const Mat3& f, double mu, double lambda) {
  const Mat3 r = nearest_rotation(f);
  const Mat3 s = r.transpose() * f;
  // dR = R [ω]×, where (tr S · I − S) ω is the axial vector of RᵀdF − dFᵀR. Singular where two stretches cancel, which
  // happens only in inverted elements; any ω will do there, because a line search follows.
  Mat3 turn = s.trace() * Mat3::Identity() - sym(s);
  if (std::abs(turn.determinant()) < 1e-9) turn += 1e-3 * Mat3::Identity();
  const Mat3 solve = turn.inverse();
  return by_columns([&](const Mat3& df) -> Mat3 {
    const Mat3 g = r.transpose() * df;
    const Vec3 omega = solve * Vec3(g(2, 1) - g(1, 2), g(0, 2) - g(2, 0), g(1, 0) - g(0, 1));
    Mat3 cross;
    cross << 0, -omega.z(), omega.y(), omega.z(), 0, -omega.x(), -omega.y(), omega.x(), 0;
    const Mat3 dr = r * cross;
    return 2 * mu * (df - dr) + lambda * (g.trace() * r + (s.trace() - 3) * dr);
  });
}

}  // namespace

void check(const Material& material) {
  expect_above_zero(material.young, "young");
  expect(material.poisson >= 0 && material.poisson < 0.5, "poisson", material.poisson,
         "a number of 0 or more and below 0.5");
}

Mat3 nearest_rotation(const Mat3& f) {
  // Newton's iteration (Higham 1986), quadratically convergent.
  if (f.determinant() > 0.1) {
    Mat3 r = f;
    for (int i = 0; i < 12; ++i) {
      const Mat3 next = 0.5 * (r + r.inverse().transpose());
      const double change = (next - r).squaredNorm();
      r = next;
      if (change < 1e-20) return r;  // the square of 1e-10
    }
  }
  const Eigen::JacobiSVD<Mat3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Mat3 u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1;  // the axis of least stretch
  return u * svd.matrixV().transpose();
}

Stress stress(Law law, const Mat3& f, double mu, double lambda) {
  switch (law) {
    case Law::kLinear: {
      const Mat3 strain = sym(f) - Mat3::Identity();
      const Mat3 p = isotropic(strain, mu, lambda);
      return {0.5 * p.cwiseProduct(strain).sum(), p};
    }
    case Law::kCorotational: {
      const Mat3 r = nearest_rotation(f);
      const double trace = r.cwiseProduct(f).sum() - 3;
      return {mu * (f - r).squaredNorm() + 0.5 * lambda * trace * trace, 2 * mu * (f - r) + lambda * trace * r};
    }
    case Law::kStVenantKirchhoff: {
      const Mat3 strain = 0.5 * (f.transpose() * f - Mat3::Identity());
      const Mat3 s = isotropic(strain, mu, lambda);
      return {0.5 * s.cwiseProduct(strain).sum(), f * s};
    }
    case Law::kNeoHookean:
      break;
  }
  const double j = f.determinant();
  const double all = lambda + mu;
  return {0.5 * mu * (f.squaredNorm() - 3) - mu * (j - 1) + 0.5 * all * (j - 1) * (j - 1),
          mu * f + (all * (j - 1) - mu) * cofactor(f)};
}

Mat9 tangent(Law law, const Mat3& f, double mu, double lambda) {
  switch (law) {
    case Law::kLinear:
      return by_columns([&](const Mat3& df) -> Mat3 { return isotropic(sym(df), mu, lambda); });
    case Law::kCorotational:
      return corotational_tangent(f, mu, lambda);
    case Law::kStVenantKirchhoff: {
      const Mat3 s = isotropic(0.5 * (f.transpose() * f - Mat3::Identity()), mu, lambda);
      return by_columns(
          [&](const Mat3& df) -> Mat3 { return df * s + f * isotropic(sym(f.transpose() * df), mu, lambda); });
    }
    case Law::kNeoHookean:
      break;
  }
  const Mat3 c = cofactor(f);
  const double all = lambda + mu;
  const double slope = all * (f.determinant() - 1) - mu;
  return by_columns([&](const Mat3& df) -> Mat3 {
    return mu * df + all * c.cwiseProduct(df).sum() * c + slope * cofactor_change(f, df);
  });
}

Mat9 without_negative(const Mat9& symmetric) {
  const Eigen::SelfAdjointEigenSolver<Mat9> eigen(symmetric);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).asDiagonal() * eigen.eigenvectors().transpose();
}

}  // namespace tendon::softbody
