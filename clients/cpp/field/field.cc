// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/field/field.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>

#include "protocol/expect.h"

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

/// The maximum ratio of the stiffness to the smallest slope of a curve. It must be less than 1 / kLeastShare.
constexpr double kMostRatio = 8;

std::vector<double> slopes_of(std::span<const double> depths, std::span<const double> forces) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (forces.size() != depths.size() || forces.empty()) {
    throw std::invalid_argument("forces: expected as many as depths, which are " + std::to_string(depths.size()) +
                                ", and at least 1");
  }
  std::vector<double> slopes;
  double depth = 0;
  double force = 0;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const std::string entry = "[" + std::to_string(i) + "]";
    expect(depths[i] > depth && depths[i] < kInfinity, "depths" + entry, depths[i], "above " + shortest(depth) + " m");
    expect(forces[i] > force && forces[i] < kInfinity, "forces" + entry, forces[i], "above " + shortest(force) + " N");
    slopes.push_back((forces[i] - force) / (depths[i] - depth));
    depth = depths[i];
    force = forces[i];
  }
  return slopes;
}

}  // namespace

void Field::set_curve(std::uint32_t material, std::span<const double> depths, std::span<const double> forces) {
  using field::DepthTable;
  const std::vector<double> slopes = slopes_of(depths, forces);
  expect(material < materials.size(), "material", material, "below " + std::to_string(materials.size()));
  const double end = depths.back();
  bool even = depths.size() <= DepthTable::kKnots;
  for (std::size_t i = 0; even && i < depths.size(); ++i) {
    even = std::abs(depths[i] - end * static_cast<double>(i + 1) / static_cast<double>(depths.size())) <= 1e-9 * end;
  }
  const std::size_t count = even ? depths.size() : DepthTable::kKnots;
  const double stiffness = std::min(slopes.back(), kMostRatio * std::ranges::min(slopes));
  FieldDepthTable table{.material = material,
                        .step = std::max(end / static_cast<double>(count), DepthTable::kLeastStep),
                        .size = static_cast<std::uint32_t>(count)};
  expect(table.step <= DepthTable::kMostStep, "depths", end,
         "at most " + shortest(DepthTable::kMostStep * static_cast<double>(count)) + " m");
  for (std::size_t i = 0; i < count; ++i) {
    const double depth = table.step * static_cast<double>(i + 1);
    const auto before = static_cast<std::size_t>(std::ranges::upper_bound(depths, depth) - depths.begin());
    const std::size_t at = std::min(before, slopes.size() - 1);
    const double start = at == 0 ? 0 : depths[at - 1];
    table.force[i] = (at == 0 ? 0 : forces[at - 1]) + slopes[at] * (depth - start) - stiffness * depth;
  }
  materials[material].stiffness = stiffness;
  std::erase_if(tables, [&](const FieldDepthTable& one) { return one.material == material; });
  tables.push_back(table);
}

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
