// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <bit>
#include <functional>
#include <limits>

#include "core/base/bytes.h"
#include "protocol/field/receiver.h"
#include "protocol/limits.h"
#include "protocol/secrets/blake2b.h"
#include "tests/protocol/field/upload.h"
#include "tests/support/refusal.h"

// An upload that does not follow the rules is refused with the name of the field, the brick or the bound, and the next
// correct one works.

namespace tendon::field_hostile_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using Refusal = std::optional<FieldReceiver::Refusal>;
using Bytes = std::vector<std::byte>;

constexpr LocalTime kStart{seconds(100)};
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Server {
  BrickStore store{{.owner_bytes = 2000 * limits::kBrickBytes}};
  FieldReceiver receiver{{.owner = 0}, store};
  LocalTime now = kStart;

  Refusal part(const Bytes& manifest, std::size_t offset, std::size_t length) {
    return part(crypto::blake2b_256(manifest), manifest, manifest.size(), offset, length);
  }
  Refusal part(const FieldName& field, const Bytes& manifest, std::size_t size, std::size_t offset,
               std::size_t length) {
    return receiver.take(
        now, OfferField{.field = field,
                        .size = static_cast<std::uint32_t>(size),
                        .offset = static_cast<std::uint32_t>(offset),
                        .part = {manifest.begin(), manifest.begin() + static_cast<std::ptrdiff_t>(length)}});
  }
  /// Sends all parts and returns the first error.
  Refusal offer(const Bytes& manifest) { return offer(crypto::blake2b_256(manifest), manifest); }
  Refusal offer(const FieldName& field, const Bytes& manifest) {
    for (std::size_t at = 0; at < manifest.size(); at += limits::kMaxFieldPart) {
      const auto bytes = std::span(manifest).subspan(at, std::min(manifest.size() - at, limits::kMaxFieldPart));
      const OfferField part{.field = field,
                            .size = static_cast<std::uint32_t>(manifest.size()),
                            .offset = static_cast<std::uint32_t>(at),
                            .part = {bytes.begin(), bytes.end()}};
      if (auto refused = receiver.take(now, part)) return refused;
    }
    return {};
  }
  Refusal brick(const BrickHash& hash, std::span<const std::byte> bytes) {
    return receiver.take(now, FieldBrick{.hash = hash, .weights = bytes});
  }
};

const std::vector<FieldSender::Brick>& bricks() {
  static const auto kBricks = random_bricks(3, 1);
  return kBricks;
}
BrickHash hash_of(std::size_t i) { return crypto::blake2b_128(bricks()[i].bytes); }

using Primitives = std::vector<field::Primitive>;
const field::Primitive kFloor{.shape = field::Plane{.at = {0.01, 0.02, 0.03}}, .material = 1};
const field::Primitive kBall{.shape = field::Sphere{.centre = {0.01, 0.02, 0.03}, .radius = 0.04}, .hollow = true};
const field::Primitive kRod{
    .shape = field::Capsule{.from = {0.01, 0.02, 0.03}, .to = {0.04, 0.05, 0.06}, .radius = 0.07}, .material = 7};
const field::Primitive kBox{.shape = field::Box{.centre = {0.01, -0.02, 0.03},
                                                .half = {0.05, 0.03, 0.01},
                                                .rounding = 0.005,
                                                .turn = {.w = 1, .x = 0, .y = 0, .z = 0}},
                            .material = 2};

Bytes manifest_of(std::span<const FieldSender::Brick> of, const Primitives& primitives = {}) {
  const FieldSender sender({}, lattice_of_1024(), of, primitives);
  return {sender.manifest().begin(), sender.manifest().end()};
}
/// 210 bytes: the head, three bricks, and a primitive.
Bytes good() { return manifest_of(bricks(), {kBox}); }

template <class Number>
Bytes with(std::size_t at, Number number) {
  Bytes manifest = good();
  if constexpr (std::is_same_v<Number, double>) {
    put_little_endian(std::bit_cast<std::uint64_t>(number), manifest.data() + at);
  } else {
    put_little_endian(number, manifest.data() + at);
  }
  return manifest;
}
constexpr std::size_t kScale = 32;
constexpr std::size_t kLattice = 40;
constexpr std::size_t kCount = 46;
constexpr std::size_t kFirst = FieldManifest::kHead;
constexpr std::size_t kPrimitive = kFirst + 3 * FieldManifest::kEntry;

struct Case {
  const char* said;  ///< part of the refusal
  std::function<Refusal(Server&)> attack;
};

const std::vector<Case>& cases() {
  const auto offered = [](const Bytes& manifest) { return [manifest](Server& s) { return s.offer(manifest); }; };
  const auto number = [offered](std::size_t at, auto value) { return offered(with(at, value)); };
  const auto primitive = [offered](const field::Primitive& one, std::size_t place, double value) {
    Bytes manifest = manifest_of(bricks(), {one});
    put_little_endian(std::bit_cast<std::uint64_t>(value), manifest.data() + kPrimitive + 3 + 8 * place);
    return offered(manifest);
  };
  static const std::vector<Case> kCases = {
      // Parts:
      {"part = 0: expected 1 … 210", [](Server& s) { return s.part(good(), 0, 0); }},
      {"part = 210: expected 1 … 209", [](Server& s) { return s.part({}, good(), 210, 1, 210); }},
      {"part = 1001: expected 1 … 1000", [](Server& s) { return s.part({}, Bytes(2000), 2000, 0, 1001); }},
      {"size = 0: expected 73 … 26491 bytes", [](Server& s) { return s.part({}, good(), 0, 0, 1); }},
      {"size = 4294967295: expected 73 …", [](Server& s) { return s.part({}, good(), 0xFFFFFFFF, 0, 1); }},
      {"offset = 300: expected below 210", [](Server& s) { return s.part({}, good(), 210, 300, 1); }},
      {"offset = 4294967295: expected below", [](Server& s) { return s.part({}, good(), 210, 0xFFFFFFFF, 1); }},
      {"offset = 50: expected at most 0", [](Server& s) { return s.part({}, good(), 210, 50, 1); }},
      {"offset = 3: expected at most 2",
       [](Server& s) {
         s.part({}, good(), 210, 0, 2);
         const Refusal refused = s.part({}, good(), 210, 3, 1);
         s.receiver.drop({});
         return refused;
       }},
      {"size = 211: expected 210",
       [](Server& s) {
         s.part({}, good(), 210, 0, 2);
         const Refusal refused = s.part({}, good(), 211, 2, 1);
         s.receiver.drop({});
         return refused;
       }},
      {"field 00000000…: the manifest has the hash", [](Server& s) { return s.offer({}, good()); }},
      // Manifests:
      {"bricks = 65535: expected at most 1023", number(kCount, std::uint16_t{65535})},
      {"bricks = 0: expected 1 … 1023, or a primitive", number(kCount, std::uint32_t{0})},
      {"size = 210: expected 141 bytes", number(kCount, std::uint16_t{0})},
      {"size = 210: expected 187 bytes", number(kCount, std::uint16_t{2})},
      {"scale = 0: expected", number(kScale, 0.0)},
      {"scale = nan: expected", number(kScale, kNaN)},
      {"scale = 1e+12: expected", number(kScale, 1e12)},
      {"scale = inf: expected", number(kScale, kInfinity)},
      {"scale = -1e-07: expected", number(kScale, -1e-7)},
      {"spacing = 0: expected 0.00025 … 0.008 m", number(24, 0.0)},
      {"spacing = nan: expected", number(24, kNaN)},
      {"spacing = 0.009: expected", number(24, 0.009)},
      {"origin.x = nan: expected ±1e12 m", number(0, kNaN)},
      {"origin.y = inf: expected", number(8, kInfinity)},
      {"origin.z = -1e+13: expected", number(16, -1e13)},
      {"lattice.x = 0: expected 1 or more", number(kLattice, std::uint16_t{0})},
      {"lattice.z = 65535: expected", number(kLattice + 4, std::uint16_t{65535})},
      {"lattice = 8e+05: expected at most 65536 cells",
       number(kLattice, std::uint64_t{3} << 48U | 100U | 100U << 16U | std::uint64_t{80} << 32U)},
      {"bricks[2].place.x = 16: expected 0 … 15", number(kFirst + 2 * 23, std::uint16_t{16})},
      {"bricks[0].place.z = 65535: expected 0 … 7", number(kFirst + 4, std::uint16_t{65535})},
      {"bricks[1].place: expected a place without a brick", number(kFirst + 23, std::uint16_t{0})},
      {"bricks[0].material = 8: expected 0 … 7", number(kFirst + 6, std::uint8_t{8})},
      {"primitives = 33: expected at most 32", number(kCount + 2, std::uint16_t{33})},
      {"primitives = 65535: expected at most 32", number(kCount + 2, std::uint16_t{65535})},
      {"size = 210: expected 119 bytes", number(kCount + 2, std::uint16_t{0})},
      {"primitives[0].kind = 0: expected 1 … 4", number(kPrimitive, std::uint8_t{0})},
      {"primitives[0].kind = 5: expected 1 … 4", number(kPrimitive, std::uint8_t{5})},
      {"primitives[0].numbers[4] = 0.03: expected 0", number(kPrimitive, std::uint8_t{2})},
      {"primitives[0].hollow = 2: expected 0 or 1", number(kPrimitive + 1, std::uint8_t{2})},
      {"primitives[0].material = 8: expected 0 … 7", number(kPrimitive + 2, std::uint8_t{8})},
      {"primitives[0].numbers[0] = nan: expected ±1e12", primitive(kBox, 0, kNaN)},
      {"primitives[0].numbers[2] = inf: expected", primitive(kBox, 2, kInfinity)},
      {"primitives[0].numbers[5] = -1e+13: expected", primitive(kBox, 5, -1e13)},
      {"primitives[0]: box.half = 0: expected", primitive(kBox, 3, 0.0)},
      {"primitives[0]: box.rounding = 0.02: expected", primitive(kBox, 6, 0.02)},
      {"primitives[0]: box.turn.w = 0: expected", primitive(kBox, 7, 0.0)},
      {"primitives[0]: sphere.radius = 0: expected", primitive(kBall, 3, 0.0)},
      {"primitives[0]: sphere.radius = -1: expected", primitive(kBall, 3, -1.0)},
      {"primitives[0].numbers[4] = nan: expected 0", primitive(kBall, 4, kNaN)},
      {"primitives[0]: capsule.radius = 0: expected", primitive(kRod, 6, 0.0)},
      {"primitives[0]: plane.normal = 0: expected", primitive(kFloor, 5, 0.0)},
      // Too many:
      {"offers = 4: expected at most 3",
       [](Server& s) {
         Refusal last;
         for (std::uint16_t i = 1; i <= 10'000; ++i) {
           last = s.part({}, with(0, static_cast<double>(i)), 210, 0, 1);
           FieldName name{};
           put_little_endian(i, name.data());
           last = s.part(name, good(), 210, 0, 100);
         }
         s.now += seconds(30);  // they were never sent
         return last;
       }},
      {"bricks = 2046: expected at most 2000 of all fields of a client",
       [](Server& s) {
         const auto one = manifest_of(random_bricks(1023, 2));
         const auto two = manifest_of(random_bricks(1023, 3));
         EXPECT_FALSE(s.offer(one));
         const Refusal refused = s.offer(two);
         s.receiver.drop(crypto::blake2b_256(one));
         return refused;
       }},
      // Bricks:
      {"weights = 0: expected 1024", [](Server& s) { return s.brick(hash_of(0), {}); }},
      {"weights = 1023: expected 1024",
       [](Server& s) { return s.brick(hash_of(0), std::span(bricks()[0].bytes).first(1023)); }},
      {"weights = 1025: expected 1024", [](Server& s) { return s.brick(hash_of(0), Bytes(1025)); }},
      {"expected a brick of an offered field", [](Server& s) { return s.brick(hash_of(0), bricks()[0].bytes); }},
      {"the bytes have the hash",
       [](Server& s) {
         EXPECT_FALSE(s.offer(good()));
         const Refusal refused = s.brick(hash_of(0), bricks()[1].bytes);
         EXPECT_EQ(s.store.bricks(), 0U);
         return refused;
       }},
      {"expected at most 5e+05 bytes per second",
       [](Server& s) {
         Refusal last;
         for (int i = 0; i < 1000; ++i) last = s.brick(hash_of(0), bricks()[0].bytes);
         s.now += seconds(2);
         return last;
       }},
  };
  return kCases;
}

TEST(FieldHostile, EveryAttackIsRefusedByNameAndTheNextFieldWorks) {
  for (const Case& one : cases()) {
    Server server;
    const Refusal refused = one.attack(server);
    ASSERT_TRUE(refused) << one.said;
    EXPECT_NE(refused->detail.find(one.said), std::string::npos) << refused->detail << "\nexpected " << one.said;
    EXPECT_TRUE(refused->detail.starts_with("field ") || refused->detail.starts_with("brick ")) << refused->detail;
    EXPECT_LE(refused->detail.size(), limits::kMaxDetail) << refused->detail;
    EXPECT_EQ(server.store.bricks(), 0U) << one.said;

    const Refusal offered = server.offer(good());
    ASSERT_FALSE(offered) << one.said << ": " << offered->detail;
    for (std::size_t i = 0; i < bricks().size(); ++i) EXPECT_FALSE(server.brick(hash_of(i), bricks()[i].bytes));
    server.now += seconds(1);
    while (server.receiver.next_status(server.now)) {
    }
    EXPECT_TRUE(server.receiver.ready(crypto::blake2b_256(good()))) << one.said;
  }
}

TEST(FieldHostile, APlaceOf2To31IsRefusedBeforeItIsSent) {
  for (const std::int32_t along :
       {std::numeric_limits<std::int32_t>::min(), -1, 16, std::numeric_limits<std::int32_t>::max()}) {
    auto wrong = bricks();
    wrong[2].place[0] = along;
    const std::string said = thrown_by([&] { FieldSender({}, lattice_of_1024(), wrong); });
    EXPECT_EQ(said, "bricks[2].place.x = " + shortest(along) + ": expected 0 … 15");
  }
}

TEST(FieldHostile, TooManyOrNoPartsAreRefusedBeforeTheyAreSent) {
  const std::vector<PlacedBrick> many(65'535);
  const Primitives balls(33, kBall);
  EXPECT_EQ(thrown_by([&] { encode_manifest(lattice_of_1024(), many); }), "bricks = 65535: expected at most 1023");
  EXPECT_EQ(thrown_by([&] { encode_manifest({}, {}, balls); }), "primitives = 33: expected at most 32");
  EXPECT_EQ(thrown_by([&] { encode_manifest({}, {}); }), "bricks = 0: expected 1 … 1023, or a primitive");
}

TEST(FieldHostile, AnInvalidPrimitiveIsRefusedBeforeItIsSent) {
  field::Primitive flat = kBox;
  std::get<field::Box>(flat.shape).half.y() = 0;
  const std::string said = thrown_by([&] { encode_manifest({}, {}, Primitives{kBall, flat}); });
  EXPECT_TRUE(said.starts_with("primitives[1]: box.half = 0: expected")) << said;
}

TEST(FieldHostile, AStatusDoesNotTellWhatAnotherKeyHasUploaded) {
  Server server;
  ASSERT_FALSE(server.offer(good()));
  for (std::size_t i = 0; i < bricks().size(); ++i) ASSERT_FALSE(server.brick(hash_of(i), bricks()[i].bytes));
  FieldReceiver guesser({.owner = 1}, server.store);
  const Bytes manifest = good();
  const FieldName name = crypto::blake2b_256(manifest);
  ASSERT_FALSE(guesser.take(kStart, OfferField{.field = name, .size = 210, .offset = 0, .part = manifest}));
  const auto status = guesser.next_status(kStart);
  ASSERT_TRUE(status);
  for (std::size_t i = 0; i < bricks().size(); ++i) {
    EXPECT_TRUE(misses(*status, i));
    EXPECT_EQ(guesser.brick(hash_of(i)), nullptr);
  }
  EXPECT_FALSE(guesser.ready(name));
}

TEST(FieldHostile, AnOfferThatIsNeverSentExpiresAfter30Seconds) {
  Server server;
  ASSERT_FALSE(server.part(good(), 0, 100));
  EXPECT_EQ(server.receiver.offers(), 1U);
  int statuses = 0;
  const auto wait = [&](Duration length) {
    for (const LocalTime end = server.now + length; server.now < end; server.now += milliseconds(1)) {
      while (server.receiver.next_status(server.now)) ++statuses;
    }
  };
  wait(seconds(29));
  EXPECT_EQ(server.receiver.offers(), 1U);
  EXPECT_EQ(statuses, 29 * 20);
  wait(milliseconds(1001));
  EXPECT_EQ(server.receiver.offers(), 0U);
  EXPECT_EQ(server.receiver.due(), LocalTime::max());
}

TEST(FieldHostile, AFullStoreTakesFromTheOwnerWithTheMostBricks) {
  BrickStore store({.bytes = 10 * limits::kBrickBytes, .owner_bytes = 8 * limits::kBrickBytes, .owners = 2});
  const auto put = [&](BrickStore::Owner owner, unsigned first, unsigned last) {
    for (unsigned i = first; i <= last; ++i) {
      BrickHash hash{};
      hash[0] = static_cast<std::byte>(i);
      store.put(owner, hash, BrickBytes{static_cast<std::byte>(i)});
    }
  };
  const auto has = [&](BrickStore::Owner owner, unsigned i) {
    BrickHash hash{};
    hash[0] = static_cast<std::byte>(i);
    const BrickBytes* const found = store.find(owner, hash);
    return found != nullptr && found->front() == static_cast<std::byte>(i);
  };
  put(0, 1, 8);
  put(1, 11, 12);
  EXPECT_EQ(store.bricks(), 10U);
  put(1, 13, 15);
  EXPECT_EQ(store.held(0), 5U);
  EXPECT_EQ(store.held(1), 5U);
  EXPECT_FALSE(has(0, 3));
  EXPECT_TRUE(has(0, 4));
  put(0, 21, 200);  // a flood
  EXPECT_EQ(store.held(1), 5U);
  for (unsigned i = 11; i <= 15; ++i) EXPECT_TRUE(has(1, i));
  EXPECT_FALSE(has(0, 11));
  EXPECT_EQ(store.bricks(), 10U);
}

}  // namespace
}  // namespace tendon::field_hostile_test
