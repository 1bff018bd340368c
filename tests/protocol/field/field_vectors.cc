// SPDX-License-Identifier: Apache-2.0
#include "tests/protocol/field/field_vectors.h"

#include <bit>
#include <span>
#include <variant>

#include "core/base/bytes.h"
#include "core/base/expect.h"
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
    const field::SampledField field = field::sampled(distance, one.low, one.high, one.spacing);
    lattice = field.lattice;
    for (const auto& [place, weights] : field.bricks) {
      const Vec3 middle(8 * Vec3(place[0], place[1], place[2]) + Vec3::Constant(3.5));
      bricks.push_back({.place = {place[0], place[1], place[2]},
                        .material = material_at(lattice.origin + lattice.spacing * middle),
                        .hash = crypto::blake2b_128(std::as_bytes(std::span(weights)))});
      out.bricks.push_back(weights);
    }
  }
  std::vector<Primitive> primitives = one.primitives;
  for (Primitive& primitive : primitives) primitive.material = material_at(centre_of(primitive));
  out.manifest = encode_manifest(lattice, bricks, primitives);
  return out;
}

std::string numbers(std::span<const double> values) {
  std::string out;
  for (const double value : values) out += (out.empty() ? "" : ", ") + shortest(value);
  return "[" + out + "]";
}

std::string shape(const field::Primitive& primitive) {
  const std::vector<std::byte> manifest = encode_manifest({}, {}, std::span(&primitive, 1));
  const std::span<const std::byte> entry = std::span(manifest).subspan(FieldManifest::kHead);
  std::vector<double> values(FieldManifest::kNumbers);
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = std::bit_cast<double>(get_little_endian<std::uint64_t>(&entry[3 + 8 * i]));
  }
  return R"({"kind": )" + std::to_string(std::to_integer<int>(entry[0])) + R"(, "hollow": )" +
         (primitive.hollow ? "true" : "false") + R"(, "numbers": )" + numbers(values) + "}";
}

}  // namespace tendon::field_vectors
