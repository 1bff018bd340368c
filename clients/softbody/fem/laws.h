// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstring>

#include "clients/softbody/fem/kernel.h"
#include "clients/softbody/fem/material.h"

namespace tendon::softbody {

/// The laws of material.h for a scalar (double) or for four at a time (Lanes). µ and λ are premultiplied by the
/// integration volume, so energies are in J and P is in N·m.

/// Newton iterations of the polar decomposition, and the largest accepted squared change of the last one. A lane that
/// changes more, or with det F below kPolarDeterminant, is computed separately by nearest_rotation().
inline constexpr int kPolarSteps = 6;
inline constexpr double kPolarChange = 1e-20;
inline constexpr double kPolarDeterminant = 0.1;

namespace kernel {

[[gnu::always_inline]] inline double lane(double number, std::size_t) { return number; }
[[gnu::always_inline]] inline double lane(const Lanes& number, std::size_t index) { return number[index]; }
[[gnu::always_inline]] inline void set_lane(double& number, std::size_t, double value) { number = value; }
[[gnu::always_inline]] inline void set_lane(Lanes& number, std::size_t index, double value) { number[index] = value; }
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // as in kernel.cc: it is always inlined
[[gnu::always_inline]] inline Lanes lanes_at(const double* numbers) {
  Lanes lanes;
  std::memcpy(&lanes, numbers, sizeof lanes);
  return lanes;
}
#pragma GCC diagnostic pop
template <class Number>
inline constexpr std::size_t kLanesOf = sizeof(Number) / sizeof(double);

/// c = ∂J/∂F. A matrix is nine numbers in column-major order.
template <class Number>
[[gnu::always_inline]] inline void cofactor(const Number* f, Number* c) {
  const auto cross = [](const Number* a, const Number* b, Number* r) __attribute__((always_inline)) {
    r[0] = a[1] * b[2] - a[2] * b[1];
    r[1] = a[2] * b[0] - a[0] * b[2];
    r[2] = a[0] * b[1] - a[1] * b[0];
  };
  cross(f + 3, f + 6, c);
  cross(f + 6, f, c + 3);
  cross(f, f + 3, c + 6);
}

template <class Number>
[[gnu::always_inline]] inline void polar(const Number* f, Number* r) {
  Number c[9];
  cofactor(f, c);
  const Number det = f[0] * c[0] + f[1] * c[1] + f[2] * c[2];
  Number change = det - det;
  for (int i = 0; i < 9; ++i) r[i] = f[i];
  for (int step = 0; step < kPolarSteps; ++step) {
    cofactor(r, c);
    const Number half = 0.5 / (r[0] * c[0] + r[1] * c[1] + r[2] * c[2]);
    change = det - det;
    for (int i = 0; i < 9; ++i) {
      const Number next = 0.5 * r[i] + half * c[i];
      change += (next - r[i]) * (next - r[i]);
      r[i] = next;
    }
  }
  for (std::size_t k = 0; k < kLanesOf<Number>; ++k) {
    if (lane(det, k) > kPolarDeterminant && lane(change, k) < kPolarChange) continue;
    Mat3 alone;
    for (int i = 0; i < 9; ++i) alone.data()[i] = lane(f[i], k);
    if (!alone.allFinite()) continue;
    alone = nearest_rotation(alone);
    for (int i = 0; i < 9; ++i) set_lane(r[i], k, alone.data()[i]);
  }
}

/// Adds the energy at F to `energy` and writes the first Piola-Kirchhoff stress P to `p`.
template <Law kLaw, class Number>
[[gnu::always_inline]] inline void respond(const Number* f, const Number& mu, const Number& lambda, Number& energy,
                                           Number* p) {
  if constexpr (kLaw == Law::kNeoHookean) {
    Number c[9];
    cofactor(f, c);
    const Number more = f[0] * c[0] + f[1] * c[1] + f[2] * c[2] - 1.0;
    Number square = more - more - 3.0;
    for (int i = 0; i < 9; ++i) square += f[i] * f[i];
    const Number all = lambda + mu;
    energy += 0.5 * mu * square + more * (0.5 * all * more - mu);
    const Number slope = all * more - mu;
    for (int i = 0; i < 9; ++i) p[i] = mu * f[i] + slope * c[i];
  } else if constexpr (kLaw == Law::kCorotational) {
    Number r[9];
    polar(f, r);
    Number trace = r[0] * f[0] - 3.0;
    for (int i = 1; i < 9; ++i) trace += r[i] * f[i];
    Number square = trace - trace;
    for (int i = 0; i < 9; ++i) {
      const Number d = f[i] - r[i];
      square += d * d;
      p[i] = 2.0 * mu * d + lambda * trace * r[i];
    }
    energy += mu * square + 0.5 * lambda * trace * trace;
  } else {
    Number strain[9];
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        if constexpr (kLaw == Law::kStVenantKirchhoff) {
          strain[i + 3 * j] = 0.5 * (f[3 * i] * f[3 * j] + f[3 * i + 1] * f[3 * j + 1] + f[3 * i + 2] * f[3 * j + 2] -
                                     (i == j ? 1 : 0));
        } else {
          strain[i + 3 * j] = 0.5 * (f[i + 3 * j] + f[j + 3 * i]) - (i == j ? 1.0 : 0.0);
        }
      }
    }
    const Number volumetric = lambda * (strain[0] + strain[4] + strain[8]);
    Number s[9];
    for (int i = 0; i < 9; ++i) s[i] = 2.0 * mu * strain[i];
    for (int i = 0; i < 9; i += 4) s[i] += volumetric;
    for (int i = 0; i < 9; ++i) energy += 0.5 * s[i] * strain[i];
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        p[i + 3 * j] =
            kLaw == Law::kLinear ? s[i + 3 * j] : f[i] * s[3 * j] + f[i + 3] * s[3 * j + 1] + f[i + 6] * s[3 * j + 2];
      }
    }
  }
}

}  // namespace kernel
}  // namespace tendon::softbody
