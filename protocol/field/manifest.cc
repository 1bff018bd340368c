// SPDX-License-Identifier: Apache-2.0
#include "protocol/field/manifest.h"

#include <algorithm>
#include <bit>
#include <bitset>
#include <cmath>
#include <stdexcept>
#include <string_view>

#include "core/base/bytes.h"
#include "core/base/expect.h"
#include "core/field/field.h"

namespace tendon {
namespace {

using field::BrickField;

constexpr std::array<std::string_view, 3> kAxisNames = {".x", ".y", ".z"};

double f64_at(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return std::bit_cast<double>(get_little_endian<std::uint64_t>(bytes.data() + at));
}
std::uint16_t u16_at(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return get_little_endian<std::uint16_t>(bytes.data() + at);
}

std::string of_brick(std::size_t i, std::string_view part) {
  return "bricks[" + std::to_string(i) + "]." + std::string(part);
}

}  // namespace

std::vector<std::byte> encode_manifest(const FieldLattice& lattice, std::span<const PlacedBrick> bricks) {
  if (bricks.size() > BrickField::kMostBricks) {
    throw std::invalid_argument(not_expected("bricks", static_cast<double>(bricks.size()), "1 … 1023"));
  }
  std::vector<std::byte> bytes(FieldManifest::kHead + bricks.size() * FieldManifest::kEntry);
  std::byte* to = bytes.data();
  const auto put = [&to](auto number) {
    put_little_endian(number, to);
    to += sizeof number;
  };
  for (const double number :
       {lattice.origin.x(), lattice.origin.y(), lattice.origin.z(), lattice.spacing, lattice.scale}) {
    put(std::bit_cast<std::uint64_t>(number));
  }
  for (const std::uint16_t along : lattice.bricks) put(along);
  put(static_cast<std::uint16_t>(bricks.size()));
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t along = bricks[i].place[axis];
      if (along < 0 || along >= lattice.bricks[axis]) {  // it may not fit into 16 bits
        throw std::invalid_argument(not_expected(of_brick(i, "place") + std::string(kAxisNames[axis]), along,
                                                 "0 … " + std::to_string(lattice.bricks[axis] - 1)));
      }
      put(static_cast<std::uint16_t>(along));
    }
    put(bricks[i].material);
    to = std::copy(bricks[i].hash.begin(), bricks[i].hash.end(), to);
  }
  if (const std::string refused = FieldManifest(bytes).refused(); !refused.empty())
    throw std::invalid_argument(refused);
  return bytes;
}

std::string FieldManifest::refused_head() const {
  if (std::string why = lattice().refused(); !why.empty()) return why;
  const std::size_t count = bricks();
  if (count == 0 || count > BrickField::kMostBricks) {
    return not_expected("bricks", static_cast<double>(count), "1 … 1023");
  }
  return {};
}

std::string FieldManifest::refused() const {
  if (!has_head()) return not_expected("manifest", static_cast<double>(bytes_.size()), "48 bytes or more");
  if (std::string head = refused_head(); !head.empty()) return head;
  const std::size_t expected = kHead + bricks() * kEntry;
  if (bytes_.size() != expected) {
    return not_expected("manifest", static_cast<double>(bytes_.size()), std::to_string(expected) + " bytes");
  }
  const auto along = lattice().bricks;
  std::bitset<BrickField::kMostCells> taken;
  for (std::size_t i = 0; i < bricks(); ++i) {
    const PlacedBrick one = brick(i);
    std::size_t cell = 0;
    for (std::size_t axis = 3; axis-- > 0;) {
      if (one.place[axis] >= along[axis]) {
        return not_expected(of_brick(i, "place") + std::string(kAxisNames[axis]), one.place[axis],
                            "0 … " + std::to_string(along[axis] - 1));
      }
      cell = cell * along[axis] + static_cast<std::size_t>(one.place[axis]);
    }
    if (taken.test(cell)) return of_brick(i, "place") + ": expected a place without a brick";
    taken.set(cell);
    if (one.material >= field::Field::kMostMaterials)
      return not_expected(of_brick(i, "material"), one.material, "0 … 31");
  }
  return {};
}

FieldLattice FieldManifest::lattice() const noexcept {
  return {.origin = {f64_at(bytes_, 0), f64_at(bytes_, 8), f64_at(bytes_, 16)},
          .spacing = f64_at(bytes_, 24),
          .scale = f64_at(bytes_, 32),
          .bricks = {u16_at(bytes_, 40), u16_at(bytes_, 42), u16_at(bytes_, 44)}};
}

std::size_t FieldManifest::bricks() const noexcept { return has_head() ? u16_at(bytes_, 46) : 0; }

std::size_t FieldManifest::known() const noexcept {
  return has_head() ? std::min(bricks(), (bytes_.size() - kHead) / kEntry) : 0;
}

PlacedBrick FieldManifest::brick(std::size_t i) const noexcept {
  const std::size_t at = kHead + i * kEntry;
  PlacedBrick one{.place = {u16_at(bytes_, at), u16_at(bytes_, at + 2), u16_at(bytes_, at + 4)},
                  .material = std::to_integer<std::uint8_t>(bytes_[at + 6])};
  std::ranges::copy(hash(i), one.hash.begin());
  return one;
}

std::span<const std::byte, sizeof(BrickHash)> FieldManifest::hash(std::size_t i) const noexcept {
  return bytes_.subspan(kHead + i * kEntry + 7).first<sizeof(BrickHash)>();
}

std::string short_name(std::span<const std::byte> hash) {
  constexpr std::string_view kHexDigits = "0123456789abcdef";
  std::string out;
  for (const std::byte b : hash.first(std::min<std::size_t>(hash.size(), 4))) {
    out += kHexDigits[std::to_integer<unsigned>(b) >> 4U];
    out += kHexDigits[std::to_integer<unsigned>(b) & 15U];
  }
  return out + "…";
}

}  // namespace tendon
