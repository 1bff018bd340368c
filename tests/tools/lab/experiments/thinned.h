// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace tendon::lab {

/// Evenly spaced samples in bounded memory: all of them up to `most`, then every second one, every fourth, and so on. A
/// short run is exact; a long one keeps at least `most` / 2 samples, deterministically.
template <class T>
class Thinned {
 public:
  explicit Thinned(std::size_t most) : most_(std::max<std::size_t>(most, 2)) {}

  void observe(const T& sample) {
    if (seen_++ % stride_ != 0) return;
    if (kept_.size() == most_) {
      for (std::size_t i = 0; 2 * i < kept_.size(); ++i) kept_[i] = kept_[2 * i];
      kept_.resize((kept_.size() + 1) / 2);
      stride_ *= 2;
      if ((seen_ - 1) % stride_ != 0) return;
    }
    kept_.push_back(sample);
  }

  const std::vector<T>& kept() const noexcept { return kept_; }
  std::uint64_t seen() const noexcept { return seen_; }

 private:
  std::size_t most_;
  std::vector<T> kept_;
  std::uint64_t seen_ = 0;
  std::uint64_t stride_ = 1;
};

/// The smallest sample that is at least as large as the fraction `p` (0 < p ≤ 1) of all. nullopt if there are none.
template <class T>
std::optional<T> percentile(std::vector<T> samples, double p) {
  if (samples.empty()) return std::nullopt;
  const double rank =
      std::clamp(std::ceil(p * static_cast<double>(samples.size())), 1.0, static_cast<double>(samples.size()));
  const auto nth = samples.begin() + static_cast<std::ptrdiff_t>(rank) - 1;
  std::nth_element(samples.begin(), nth, samples.end());
  return *nth;
}

}  // namespace tendon::lab
