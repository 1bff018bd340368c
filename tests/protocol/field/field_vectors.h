// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocol/field/manifest.h"

namespace tendon::field_vectors {

/// A field that the clients must encode in the same way.
struct Case {
  std::string name;
  std::vector<field::Primitive> sampled{};  ///< at most one; its distance is sampled between `low` and `high`
  Vec3 low = Vec3::Zero();
  Vec3 high = Vec3::Zero();
  double spacing = 1e-3;
  std::vector<field::Primitive> region{};      ///< at most one; the material is 1 if the centre is in the region
  std::vector<field::Primitive> primitives{};  ///< without their materials
};

struct Encoded {
  std::vector<std::byte> manifest;
  std::vector<field::BrickField::Weights> bricks;
};

const std::vector<Case>& cases();
Encoded encoded(const Case& one);

// In JSON.
std::string numbers(std::span<const double> values);
/// `kind` and `numbers` are those of a manifest.
std::string shape(const field::Primitive& primitive);

}  // namespace tendon::field_vectors
