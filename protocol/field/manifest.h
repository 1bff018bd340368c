// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/field/brick_field.h"
#include "core/field/field.h"
#include "core/field/primitives.h"

// Defines the encoding of a field: the union of a signed distance field and of primitives. The signed distance field is
// stored in bricks of 8³ weights (int16, little-endian, x is the fastest index). A brick is identified by its BLAKE2b-128
// hash. The manifest contains the lattice, the list of bricks, and the primitives. The field is identified by the
// BLAKE2b-256 hash of the manifest. If a part of the object is cut, only the bricks with new hashes must be sent.

namespace tendon::limits {

inline constexpr std::size_t kBrickBytes = sizeof(field::BrickField::Weights);  ///< fits into a datagram
inline constexpr std::size_t kMaxFieldPart = 1000;  ///< bytes; each part fits into a datagram

}  // namespace tendon::limits

namespace tendon {

using BrickBytes = std::array<std::byte, limits::kBrickBytes>;
using BrickHash = std::array<std::byte, 16>;
using FieldName = std::array<std::byte, 32>;

using FieldLattice = field::BrickField::Lattice;

struct PlacedBrick {
  std::array<std::int32_t, 3> place{};  ///< in bricks
  std::uint8_t material = 0;
  BrickHash hash{};
};

/// Encodes a manifest, all numbers little-endian:
///     origin 3 × f64 | spacing f64 | scale f64 | lattice 3 × u16 | bricks u16 | primitives u16     50 bytes
///     then for each brick:      place 3 × u16 | material u8 | hash 16 bytes                        23 bytes
///     then for each primitive:  kind u8 | hollow u8 | material u8 | numbers 11 × f64               91 bytes
/// Lengths are in m. Without bricks, the lattice is ignored. The kinds and their numbers, the rest is 0:
///     1 plane    point 3 | normal 3, a unit vector out of the solid
///     2 sphere   centre 3 | radius
///     3 capsule  one end 3 | other end 3 | radius
///     4 box      centre 3 | half of its sides 3 | rounding | rotation w, x, y, z
/// Throws std::invalid_argument with the name of the number that is out of bounds.
std::vector<std::byte> encode_manifest(const FieldLattice& lattice, std::span<const PlacedBrick> bricks,
                                       std::span<const field::Primitive> primitives = {});

/// Reads a manifest, which can be incomplete. The bytes must remain valid.
class FieldManifest {
 public:
  static constexpr std::size_t kHead = 50;
  static constexpr std::size_t kEntry = 23;
  static constexpr std::size_t kNumbers = 11;  ///< of a primitive
  static constexpr std::size_t kPrimitive = 3 + 8 * kNumbers;
  static constexpr std::size_t kLeast = kHead + kEntry;
  static constexpr std::size_t kMost =
      kHead + field::BrickField::kMostBricks * kEntry + field::Field::kMostPrimitives * kPrimitive;

  explicit FieldManifest(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {}

  /// Returns an error message for the first value that is out of bounds, or an empty string.
  std::string refused_head() const;  ///< requires kHead bytes
  std::string refused() const;       ///< of all bytes

  std::span<const std::byte> bytes() const noexcept { return bytes_; }
  bool has_head() const noexcept { return bytes_.size() >= kHead; }
  FieldLattice lattice() const noexcept;    ///< requires the head
  std::size_t bricks() const noexcept;      ///< 0 if the head is incomplete
  std::size_t known() const noexcept;       ///< number of complete entries
  std::size_t primitives() const noexcept;  ///< 0 if the head is incomplete
  std::size_t size() const noexcept;        ///< in bytes, according to the head
  PlacedBrick brick(std::size_t i) const noexcept;
  field::Primitive primitive(std::size_t i) const noexcept;  ///< requires all bytes, which must not be refused
  /// Returns brick(i).hash without copying it.
  std::span<const std::byte, sizeof(BrickHash)> hash(std::size_t i) const noexcept;

 private:
  std::string refused_primitive(std::size_t i) const;
  std::size_t place_of_primitive(std::size_t i) const noexcept { return kHead + bricks() * kEntry + i * kPrimitive; }

  std::span<const std::byte> bytes_;
};

/// Returns the first four bytes for error messages, for example "0a1b2c3d…".
std::string short_name(std::span<const std::byte> hash);

}  // namespace tendon
