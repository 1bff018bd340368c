// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/products.h"

#include <cstddef>
#include <cstring>
#include <stdexcept>

#include "clients/softbody/fem/laws.h"

// See kernel.cc.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace tendon::softbody {
namespace {

using kernel::lanes_at;

constexpr std::ptrdiff_t kColumns = 4;

struct Tall {
  const double* numbers;
  std::ptrdiff_t rows;
  std::ptrdiff_t columns;
};

template <std::ptrdiff_t kAtOnce>
[[gnu::always_inline]] inline void add_columns(const double* first, std::ptrdiff_t rows, const double* x, double* to) {
  for (std::ptrdiff_t i = 0; i < rows; i += kLanes) {
    Lanes sum = lanes_at(to + i);
    for (std::ptrdiff_t c = 0; c < kAtOnce; ++c) sum += lanes_at(first + c * rows + i) * x[c];
    std::memcpy(to + i, &sum, sizeof sum);
  }
}

template <std::ptrdiff_t kAtOnce>
[[gnu::always_inline]] inline void dot_columns(const double* first, std::ptrdiff_t rows, const double* x, double* to) {
  Lanes sums[kAtOnce] = {};
  for (std::ptrdiff_t i = 0; i < rows; i += kLanes) {
    const Lanes here = lanes_at(x + i);
    for (std::ptrdiff_t c = 0; c < kAtOnce; ++c) sums[c] += lanes_at(first + c * rows + i) * here;
  }
  for (std::ptrdiff_t c = 0; c < kAtOnce; ++c) to[c] = (sums[c][0] + sums[c][1]) + (sums[c][2] + sums[c][3]);
}

[[gnu::always_inline]] inline void multiply(const Tall& m, const double* x, double* to) {
  std::ptrdiff_t column = 0;
  for (; column + kColumns <= m.columns; column += kColumns) {
    add_columns<kColumns>(m.numbers + column * m.rows, m.rows, x + column, to);
  }
  for (; column < m.columns; ++column) add_columns<1>(m.numbers + column * m.rows, m.rows, x + column, to);
}

[[gnu::always_inline]] inline void multiply_transposed(const Tall& m, const double* x, double* to) {
  std::ptrdiff_t column = 0;
  for (; column + kColumns <= m.columns; column += kColumns) {
    dot_columns<kColumns>(m.numbers + column * m.rows, m.rows, x, to + column);
  }
  for (; column < m.columns; ++column) dot_columns<1>(m.numbers + column * m.rows, m.rows, x, to + column);
}

#ifdef __x86_64__
[[gnu::target("avx2")]] void wide_multiply(const Tall& m, const double* x, double* to) { multiply(m, x, to); }
[[gnu::target("avx2")]] void wide_multiply_transposed(const Tall& m, const double* x, double* to) {
  multiply_transposed(m, x, to);
}
bool has_wide_registers() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}
#endif

Tall checked(const MatrixXd& matrix) {
  if (matrix.rows() % static_cast<Eigen::Index>(kLanes) != 0) {
    throw std::invalid_argument("expected a multiple of four rows");
  }
  return {matrix.data(), matrix.rows(), matrix.cols()};
}

}  // namespace

void times(const MatrixXd& matrix, const VectorXd& x, VectorXd& to) {
  const Tall m = checked(matrix);
  to.setZero(m.rows);
#ifdef __x86_64__
  if (has_wide_registers()) return wide_multiply(m, x.data(), to.data());
#endif
  multiply(m, x.data(), to.data());
}

void times_transposed(const MatrixXd& matrix, const VectorXd& x, VectorXd& to) {
  const Tall m = checked(matrix);
  to.resize(m.columns);
#ifdef __x86_64__
  if (has_wide_registers()) return wide_multiply_transposed(m, x.data(), to.data());
#endif
  multiply_transposed(m, x.data(), to.data());
}

}  // namespace tendon::softbody
