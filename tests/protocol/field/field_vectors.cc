// SPDX-License-Identifier: Apache-2.0
#include "tests/protocol/field/field_vectors.h"

#include <span>
#include <stdexcept>
#include <variant>

#include "core/field/field.h"
#include "protocol/secrets/blake2b.h"

namespace tendon::field_vectors {
namespace {

using field::Box;
using field::BrickField;
using field::Capsule;
using field::Plane;
using field::Primitive;
using field::Sphere;

Vec3 centre_of(const Primitive& primitive) {
  if (const auto* plane = std::get_if<Plane>(&primitive.shape)) return plane->at;
  if (const auto* sphere = std::get_if<Sphere>(&primitive.shape)) return sphere->centre;
  if (const auto* box = std::get_if<Box>(&primitive.shape)) return box->centre;
  const auto& capsule = std::get<Capsule>(primitive.shape);
  return (capsule.from + capsule.to) / 2;
}

/// Returns the places that field::sample() fills, in its order.
std::vector<BrickField::Place> places_of(const Case& one, BrickField::Lattice& lattice) {
  BrickField field;
  const auto distance = [&](const Vec3& x) { return field::distance(one.sampled.front(), x).distance; };
  field::sample(distance, one.low, one.high, one.spacing, field);
  lattice = field.lattice();
  std::vector<BrickField::Place> places;
  for (std::uint16_t k = 0; k < lattice.bricks[2]; ++k) {
    for (std::uint16_t j = 0; j < lattice.bricks[1]; ++j) {
      for (std::uint16_t i = 0; i < lattice.bricks[0]; ++i) {
        const Vec3 middle = lattice.origin + lattice.spacing * (8 * Vec3(i, j, k) + Vec3::Constant(3.5));
        const field::SurfacePoint point = field.at(middle);
        if (point.gradient != Vec3::Zero()) places.push_back({i, j, k});
      }
    }
  }
  if (places.size() != field.bricks()) throw std::logic_error(one.name + ": a brick has no gradient at its centre");
  return places;
}

}  // namespace

const std::vector<Case>& cases() {
  const Quat turn{0.5, 0.5, -0.5, 0.5};
  const double half = 0.70710678118654757;
  const Primitive plane{.shape = Plane{.at = {0.001, 0, 0.0035}, .normal = {0, 0.6, 0.8}}};
  const Primitive sphere{.shape = Sphere{.centre = {0.001, 0.002, -0.003}, .radius = 0.02}};
  const Primitive capsule{.shape = Capsule{.from = {-0.01, 0, 0.002}, .to = {0.012, 0.004, -0.003}, .radius = 0.006}};
  const Primitive box{
      .shape =
          Box{.centre = {0.002, 0, 0}, .half = {0.01, 0.014, 0.007}, .rounding = 0.002, .turn = {half, 0, half, 0}},
      .hollow = true};
  static const std::vector<Case> all = {
      {.name = "plane",
       .sampled = {plane},
       .low = {-0.01, -0.01, -0.01},
       .high = {0.01, 0.01, 0.01},
       .spacing = 0.0015},
      {.name = "sphere",
       .sampled = {sphere},
       .low = {-0.03, -0.03, -0.03},
       .high = {0.03, 0.03, 0.03},
       .spacing = 0.002},
      {.name = "capsule of two materials",
       .sampled = {capsule},
       .low = {-0.02, -0.01, -0.013},
       .high = {0.02, 0.014, 0.011},
       .spacing = 0.001,
       .region = {{.shape = Sphere{.centre = {0.015, 0, 0}, .radius = 0.015}}}},
      {.name = "hollow box",
       .sampled = {box},
       .low = {-0.02, -0.02, -0.02},
       .high = {0.02, 0.02, 0.02},
       .spacing = 0.0025},
      {.name = "primitives",
       .region = {{.shape = Box{.centre = {0, 0, 0}, .half = {0.0015, 1, 1}, .turn = turn}}},
       .primitives = {plane, sphere, capsule, box}},
      {.name = "bricks and a primitive",
       .sampled = {sphere},
       .low = {-0.03, -0.03, -0.03},
       .high = {0.03, 0.03, 0.03},
       .spacing = 0.004,
       .primitives = {plane}}};
  return all;
}

Encoded encoded(const Case& one) {
  Encoded out;
  const auto material_at = [&](const Vec3& centre) -> std::uint8_t {
    return !one.region.empty() && field::distance(one.region.front(), centre).distance <= 0 ? 1 : 0;
  };
  BrickField::Lattice lattice;
  std::vector<PlacedBrick> bricks;
  if (!one.sampled.empty()) {
    const auto distance = [&](const Vec3& x) { return field::distance(one.sampled.front(), x).distance; };
    for (const BrickField::Place& place : places_of(one, lattice)) {
      const auto& weights = out.bricks.emplace_back(field::weights_of(distance, lattice, place));
      const Vec3 centre =
          lattice.origin + lattice.spacing * (8 * Vec3(place[0], place[1], place[2]) + Vec3::Constant(3.5));
      bricks.push_back({.place = {place[0], place[1], place[2]},
                        .material = material_at(centre),
                        .hash = crypto::blake2b_128(std::as_bytes(std::span(weights)))});
    }
  }
  std::vector<Primitive> primitives = one.primitives;
  for (Primitive& primitive : primitives) primitive.material = material_at(centre_of(primitive));
  out.manifest = encode_manifest(lattice, bricks, primitives);
  return out;
}

}  // namespace tendon::field_vectors
