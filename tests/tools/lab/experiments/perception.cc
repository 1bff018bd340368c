// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/perception.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/FFT>
#include <vector>

namespace tendon::lab {
namespace {

constexpr double kFlatTo = 40;          // Hz
constexpr double kFinest = 250;         // Hz, maximum sensitivity
constexpr double kLeastFelt = 1e-7;     // m, peak, threshold at kFinest
constexpr double kLeastFrequency = 10;  // Hz; slower motion is not vibration

}  // namespace

double detection_threshold(double frequency) noexcept {
  if (frequency > kFinest) return kLeastFelt * (frequency / kFinest) * (frequency / kFinest);
  const double corner = std::max(frequency, kFlatTo);
  return kLeastFelt * (kFinest / corner) * (kFinest / corner);
}

double sensation_level(std::span<const Vec3> velocity, Duration period) {
  const std::size_t n = velocity.size();
  if (n < 4) return kNothing;
  // Hann window; prevents leakage of slow periodic motion into the sensitive range.
  std::vector<double> window(n);
  double squares = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double s = std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / static_cast<double>(n));
    window[i] = s * s;
    squares += window[i] * window[i];
  }
  Eigen::FFT<double> fft;
  std::vector<double> samples(n);
  std::vector<std::complex<double>> spectrum;
  double power = 0;
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < n; ++i) samples[i] = window[i] * velocity[i][axis];
    fft.fwd(spectrum, samples);
    for (std::size_t k = 1; 2 * k < n; ++k) {
      const double frequency = static_cast<double>(k) / (static_cast<double>(n) * seconds(period));
      if (frequency < kLeastFrequency) continue;
      // A sine of amplitude a has power a²/2, split between the lines at f and −f.
      const double amplitude_squared = 4 * std::norm(spectrum[k]) / (squares * static_cast<double>(n));
      const double least = detection_threshold(frequency) * 2 * std::numbers::pi * frequency;
      power += amplitude_squared / (least * least);
    }
  }
  return power > 0 ? std::max(kNothing, 10 * std::log10(power)) : kNothing;
}

}  // namespace tendon::lab
