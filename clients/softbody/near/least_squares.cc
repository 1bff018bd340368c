// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/least_squares.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace tendon::softbody {
namespace {

constexpr double kRidge = 1e-12;  ///< relative to the diagonal, for columns that are linearly dependent
constexpr double kNone = 1e-12;   ///< smaller entries are zero

}  // namespace

VectorXd few_not_negative(const Squares& squares, double left, int most) {
  const auto size = squares.right.size();
  VectorXd x = VectorXd::Zero(size);
  VectorXd pull = squares.right;  // Gᵀ(b − G x)
  std::vector<Eigen::Index> in;
  std::vector<bool> is_in(static_cast<std::size_t>(size));
  std::vector<bool> barred(static_cast<std::size_t>(size));
  const VectorXd sizes = squares.gram.diagonal().cwiseSqrt();
  for (Eigen::Index round = 0; round < 8 * size && static_cast<int>(in.size()) < most; ++round) {
    Eigen::Index newest = -1;
    for (Eigen::Index i = 0; i < size; ++i) {
      const auto k = static_cast<std::size_t>(i);
      if (is_in[k] || barred[k] || !(pull[i] > 0)) continue;
      if (newest < 0 || pull[i] * sizes[newest] > pull[newest] * sizes[i]) newest = i;
    }
    if (newest < 0) break;
    in.push_back(newest);
    is_in[static_cast<std::size_t>(newest)] = true;
    for (;;) {
      MatrixXd among = squares.gram(in, in);
      among.diagonal() *= 1 + kRidge;
      const VectorXd wanted = among.ldlt().solve(VectorXd(squares.right(in)));
      double share = 1;  // keeps all entries ≥ 0
      for (std::size_t i = 0; i < in.size(); ++i) {
        const double to = wanted[static_cast<Eigen::Index>(i)];
        if (to <= 0) share = std::min(share, x[in[i]] / (x[in[i]] - to));
      }
      std::vector<Eigen::Index> stay;
      for (std::size_t i = 0; i < in.size(); ++i) {
        double& entry = x[in[i]];
        entry += share * (wanted[static_cast<Eigen::Index>(i)] - entry);
        const bool stays = share >= 1 || entry > kNone;
        if (stays) stay.push_back(in[i]);
        if (!stays) entry = 0;
        is_in[static_cast<std::size_t>(in[i])] = stays;
      }
      in = std::move(stay);
      if (share >= 1 || in.empty()) break;
    }
    pull = squares.right - squares.gram * x;
    if (is_in[static_cast<std::size_t>(newest)]) {
      barred.assign(barred.size(), false);
    } else {
      barred[static_cast<std::size_t>(newest)] = true;
    }
    // |b − G x|² = |b|² − x·(Gᵀb + Gᵀ(b − G x))
    if (squares.square - x.dot(squares.right + pull) <= left * left * squares.square) break;
  }
  return x;
}

}  // namespace tendon::softbody
