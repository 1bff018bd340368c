// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/field/field.h"

#include <algorithm>
#include <cstddef>

namespace tendon {
namespace {

BrickBytes bytes_of(const field::BrickField::Weights& weights) noexcept {
  BrickBytes bytes{};
  for (std::size_t i = 0; i < weights.size(); ++i) {
    const auto bits = static_cast<std::uint16_t>(weights[i]);
    bytes[2 * i] = static_cast<std::byte>(bits);
    bytes[2 * i + 1] = static_cast<std::byte>(bits >> 8U);
  }
  return bytes;
}

}  // namespace

Field Field::from(const std::function<double(const Vec3&)>& signed_distance, const Vec3& low, const Vec3& high,
                  const Sampling& sampling) {
  const field::SampledField sampled = field::sampled(signed_distance, low, high, sampling.spacing);
  Field field{.lattice = sampled.lattice};
  field.bricks.reserve(sampled.bricks.size());
  for (const auto& brick : sampled.bricks) {
    auto& sent = field.bricks.emplace_back();
    std::ranges::copy(brick.place, sent.place.begin());
    sent.material = sampling.material;
    sent.bytes = bytes_of(brick.weights);
  }
  return field;
}

}  // namespace tendon
