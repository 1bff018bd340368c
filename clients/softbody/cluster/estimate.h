// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/softbody/body.h"

namespace tendon::softbody {

/// A prediction of the costs from the size of a body. The constants were measured with quadratic blocks on processors
/// of 2023. The error is a factor of two or three.
///
///     factor      answer 28 ms (N / 55 539)^(4/3), set up 2.8 s (N / 55 539)², memory 320 MB (N / 55 539)^(4/3)
///     multigrid   3.3 rounds of N c / P + 6 L h + g + 3 a log₂ P on P ranks, with L = log₂(n / 4) levels of
///                 n = (N / 3)^(1/3) / 2 cells, c = 1.3 µs, h = 10 µs, g = 100 µs, a = 1.5 µs (cluster network)
///     table       m solves with the factor; 8 m (m + 1) / 2 bytes; 2 µs (k / 63)² per answer, k nodes below the patch
struct Estimate {
  struct Cost {
    double answer_s = 0;
    double set_up_s = 0;
    double bytes = 0;
  };
  struct Spread {
    int ranks = 1;
    double answer_s = 0;
  };
  Body::Size size;
  Cost table;
  Cost factor;
  std::vector<Spread> multigrid;
  enum class Take : std::uint8_t { kTable, kFactor, kMultigrid } take = Take::kTable;
  int ranks = 1;  ///< number of ranks for kMultigrid
};
inline constexpr double kFeltLate = 0.01;  ///< s
inline constexpr double kMostTableBytes = 4e9;
inline constexpr double kMostFactorBytes = 16e9;

/// `under_patch` is the number of nodes below the patch (Body::size_of).
Estimate estimate(const Body::Size& size, int under_patch, std::vector<int> ranks);

std::string in_words(const Estimate& estimate);
std::string in_json(const Estimate& estimate);

}  // namespace tendon::softbody
