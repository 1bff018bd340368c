// SPDX-License-Identifier: Apache-2.0
#include "core/control/law_support.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace tendon::law_support {

template <int N>
Principal<N> principal_stiffness(const Mat<N>& stiffness) noexcept {
  const Eigen::SelfAdjointEigenSolver<Mat<N>> solver(Mat<N>((stiffness + stiffness.transpose()) / 2));
  return {solver.eigenvalues(), solver.eigenvectors()};
}

template <int N>
double spectral_norm(const Mat<N>& stiffness) noexcept {
  const double scale = stiffness.cwiseAbs().maxCoeff();
  if (!(scale > 0)) return 0;
  const Mat<N> unit = stiffness / scale;
  const Eigen::SelfAdjointEigenSolver<Mat<N>> squares(Mat<N>(unit.transpose() * unit), Eigen::EigenvaluesOnly);
  return scale * std::sqrt(std::max(squares.eigenvalues()[N - 1], 0.0));
}

template Principal<1> principal_stiffness<1>(const Mat<1>&) noexcept;
template Principal<3> principal_stiffness<3>(const Mat<3>&) noexcept;
template Principal<6> principal_stiffness<6>(const Mat<6>&) noexcept;
template double spectral_norm<1>(const Mat<1>&) noexcept;
template double spectral_norm<3>(const Mat<3>&) noexcept;
template double spectral_norm<6>(const Mat<6>&) noexcept;

}  // namespace tendon::law_support
