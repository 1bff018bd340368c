// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "protocol/field/manifest.h"
#include "protocol/messages.h"
#include "protocol/secrets/blake2b.h"

/// Examples of the messages with the feature "fields".
namespace tendon::examples {

inline const BrickBytes& brick_weights() {
  static const BrickBytes weights = [] {
    BrickBytes same;
    same.fill(std::byte{0x7F});
    return same;
  }();
  return weights;
}
inline FieldBrick field_brick() { return {.hash = crypto::blake2b_128(brick_weights()), .weights = brick_weights()}; }
/// A field of one brick and a sphere.
inline std::vector<std::byte> manifest() {
  const PlacedBrick brick{.place = {1, 0, 2}, .material = 1, .hash = field_brick().hash};
  const field::Primitive ball{.shape = field::Sphere{.centre = {0.01, 0, -0.02}, .radius = 0.0125}};
  return encode_manifest({.origin = {-0.016, 0, 0.125}, .spacing = 0.002, .scale = 1e-6, .bricks = {2, 1, 3}},
                         std::span(&brick, 1), std::span(&ball, 1));
}
inline FieldName field_name() { return crypto::blake2b_256(manifest()); }
inline OfferField offer_field() {
  const std::vector<std::byte> whole = manifest();
  return {.field = field_name(), .size = static_cast<std::uint32_t>(whole.size()), .offset = 0, .part = whole};
}
inline UseField use_field() {
  return {.device = 1,
          .channel = 1,
          .generation = 3,
          .field = field_name(),
          .materials = {{.stiffness = 1500, .friction = 0.25},
                        {.stiffness = 300, .branch_stiffness = 150, .relaxation = 0.2, .friction = 0.5}},
          .fixtures = {{.kind = FieldFixtureKind::kLine,
                        .at = {0.01, 0, -0.02},
                        .normal = {0.6, 0, 0.8},
                        .stiffness = 200,
                        .most_force = 1.5}},
          .tables = {{.material = 1, .step = 0.002, .size = 3, .force = {-0.125, 0, 0.5}}}};
}
inline DropField drop_field() { return {.field = field_name()}; }
/// Of a manifest with 10 known bricks, the bricks 0 and 9 are missing.
inline FieldStatus field_status() {
  FieldStatus status{.field = field_name()};
  status.missing[0] = std::byte{1};
  status.missing[1] = std::byte{2};
  return status;
}
inline FieldPose field_pose() {
  return {.device = 1,
          .channel = 1,
          .sequence = 7,
          .time = PeerTime{Duration{1'020'000'000}},
          .position = {0.1, 0, -0.05},
          .orientation = {.w = 0.6, .x = 0, .y = 0.8, .z = 0},
          .velocity = {0.25, 0, 0},
          .angular_velocity = {0, 1.5, 0}};
}

}  // namespace tendon::examples
