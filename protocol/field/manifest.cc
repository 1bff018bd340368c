// SPDX-License-Identifier: Apache-2.0
#include "protocol/field/manifest.h"

#include <algorithm>
#include <bit>
#include <bitset>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <variant>

#include "core/base/bytes.h"
#include "core/base/expect.h"
#include "core/field/field.h"
#include "protocol/limits.h"

namespace tendon {
namespace {

using field::BrickField;

constexpr std::array<std::string_view, 3> kAxisNames = {".x", ".y", ".z"};
constexpr std::string_view kBricks = "at most 1023";
constexpr std::string_view kPrimitives = "at most 32";
constexpr std::string_view kMaterials = "0 … 7";
static_assert(BrickField::kMostBricks == 1023 && field::Field::kMostPrimitives == 32);
static_assert(field::Field::kMostMaterials == 8);

double f64_at(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return std::bit_cast<double>(get_little_endian<std::uint64_t>(bytes.data() + at));
}
std::uint16_t u16_at(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return get_little_endian<std::uint16_t>(bytes.data() + at);
}

std::string entry_of(std::string_view list, std::size_t i, std::string_view part) {
  return std::string(list) + "[" + std::to_string(i) + "]" + std::string(part);
}

std::string refuse(std::string_view name, std::size_t value, std::string_view expected) {
  return not_expected(name, static_cast<double>(value), expected);
}

using field::Box;
using field::Capsule;
using field::Plane;
using field::Primitive;
using field::Sphere;
using Shape = decltype(Primitive::shape);

/// The numbers of a shape in the order of the manifest.
class Numbers {
 public:
  explicit Numbers(Shape& shape) {
    std::visit([this](auto& one) { add_all(one); }, shape);
  }
  std::span<double* const> all() const noexcept { return std::span(numbers_).first(size_); }

 private:
  void add_all(Plane& plane) { add(plane.at), add(plane.normal); }
  void add_all(Sphere& sphere) { add(sphere.centre), add(sphere.radius); }
  void add_all(Capsule& capsule) { add(capsule.from), add(capsule.to), add(capsule.radius); }
  void add_all(Box& box) {
    add(box.centre), add(box.half), add(box.rounding);
    add(box.turn.w), add(box.turn.x), add(box.turn.y), add(box.turn.z);
  }
  void add(double& number) { numbers_[size_++] = &number; }
  void add(Vec3& vector) { add(vector.x()), add(vector.y()), add(vector.z()); }

  std::array<double*, FieldManifest::kNumbers> numbers_{};
  std::size_t size_ = 0;
};

/// Returns a default shape of the given kind (1 … 4).
Shape shape_of(unsigned kind) noexcept {
  switch (kind) {
    case 1:
      return Plane{};
    case 2:
      return Sphere{};
    case 3:
      return Capsule{};
    default:
      return Box{};
  }
}

}  // namespace

std::vector<std::byte> encode_manifest(const FieldLattice& lattice, std::span<const PlacedBrick> bricks,
                                       std::span<const Primitive> primitives) {
  // These may not fit into 16 bits.
  if (bricks.size() > BrickField::kMostBricks) throw std::invalid_argument(refuse("bricks", bricks.size(), kBricks));
  if (primitives.size() > field::Field::kMostPrimitives) {
    throw std::invalid_argument(refuse("primitives", primitives.size(), kPrimitives));
  }
  std::vector<std::byte> bytes(FieldManifest::kHead + bricks.size() * FieldManifest::kEntry +
                               primitives.size() * FieldManifest::kPrimitive);
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
  put(static_cast<std::uint16_t>(primitives.size()));
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::int32_t along = bricks[i].place[axis];
      if (along < 0 || along >= lattice.bricks[axis]) {  // it may not fit into 16 bits
        throw std::invalid_argument(not_expected(entry_of("bricks", i, ".place") + std::string(kAxisNames[axis]), along,
                                                 "0 … " + std::to_string(lattice.bricks[axis] - 1)));
      }
      put(static_cast<std::uint16_t>(along));
    }
    put(bricks[i].material);
    to = std::copy(bricks[i].hash.begin(), bricks[i].hash.end(), to);
  }
  for (Primitive primitive : primitives) {
    put(static_cast<std::uint8_t>(primitive.shape.index() + 1));
    put(static_cast<std::uint8_t>(primitive.hollow));
    put(primitive.material);
    const Numbers numbers(primitive.shape);
    for (std::size_t k = 0; k < FieldManifest::kNumbers; ++k) {
      put(std::bit_cast<std::uint64_t>(k < numbers.all().size() ? *numbers.all()[k] : 0.0));
    }
  }
  if (const std::string refused = FieldManifest(bytes).refused(); !refused.empty())
    throw std::invalid_argument(refused);
  return bytes;
}

std::string FieldManifest::refused_head() const {
  if (bricks() > BrickField::kMostBricks) return refuse("bricks", bricks(), kBricks);
  if (primitives() > field::Field::kMostPrimitives) return refuse("primitives", primitives(), kPrimitives);
  if (bricks() == 0 && primitives() == 0) return refuse("bricks", 0, "1 … 1023, or a primitive");
  return bricks() == 0 ? std::string() : lattice().refused();
}

std::string FieldManifest::refused() const {
  if (!has_head()) return refuse("manifest", bytes_.size(), "50 bytes or more");
  if (std::string head = refused_head(); !head.empty()) return head;
  if (bytes_.size() != size()) return refuse("manifest", bytes_.size(), std::to_string(size()) + " bytes");
  const auto along = lattice().bricks;
  std::bitset<BrickField::kMostCells> taken;
  for (std::size_t i = 0; i < bricks(); ++i) {
    const PlacedBrick one = brick(i);
    std::size_t cell = 0;
    for (std::size_t axis = 3; axis-- > 0;) {
      if (one.place[axis] >= along[axis]) {
        return not_expected(entry_of("bricks", i, ".place") + std::string(kAxisNames[axis]), one.place[axis],
                            "0 … " + std::to_string(along[axis] - 1));
      }
      cell = cell * along[axis] + static_cast<std::size_t>(one.place[axis]);
    }
    if (taken.test(cell)) return entry_of("bricks", i, ".place: expected a place without a brick");
    taken.set(cell);
    if (one.material >= field::Field::kMostMaterials) {
      return refuse(entry_of("bricks", i, ".material"), one.material, kMaterials);
    }
  }
  for (std::size_t i = 0; i < primitives(); ++i) {
    if (std::string why = refused_primitive(i); !why.empty()) return why;
  }
  return {};
}

std::string FieldManifest::refused_primitive(std::size_t i) const {
  const auto named = [i](std::string_view part) { return entry_of("primitives", i, part); };
  const std::size_t at = place_of_primitive(i);
  const auto byte = [&](std::size_t offset) { return std::to_integer<std::size_t>(bytes_[at + offset]); };
  if (byte(0) < 1 || byte(0) > std::variant_size_v<Shape>) return refuse(named(".kind"), byte(0), "1 … 4");
  if (byte(1) > 1) return refuse(named(".hollow"), byte(1), "0 or 1");
  if (byte(2) >= field::Field::kMostMaterials) return refuse(named(".material"), byte(2), kMaterials);
  Primitive one = primitive(i);
  const std::size_t used = Numbers(one.shape).all().size();
  for (std::size_t k = 0; k < kNumbers; ++k) {
    const double number = f64_at(bytes_, at + 3 + 8 * k);
    const bool holds = k < used ? std::abs(number) <= limits::kMaxValue : number == 0;
    if (!holds) return not_expected(named(".numbers[" + std::to_string(k) + "]"), number, k < used ? "±1e12" : "0");
  }
  try {
    expect_valid(one);
  } catch (const std::invalid_argument& why) {
    return named(": ") + why.what();
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

std::size_t FieldManifest::primitives() const noexcept { return has_head() ? u16_at(bytes_, 48) : 0; }

std::size_t FieldManifest::size() const noexcept { return place_of_primitive(primitives()); }

Primitive FieldManifest::primitive(std::size_t i) const noexcept {
  const std::size_t at = place_of_primitive(i);
  Primitive one{.shape = shape_of(std::to_integer<unsigned>(bytes_[at])),
                .hollow = bytes_[at + 1] != std::byte{0},
                .material = std::to_integer<std::uint8_t>(bytes_[at + 2])};
  const Numbers numbers(one.shape);
  for (std::size_t k = 0; k < numbers.all().size(); ++k) *numbers.all()[k] = f64_at(bytes_, at + 3 + 8 * k);
  return one;
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
