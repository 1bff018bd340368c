// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "protocol/field/receiver.h"
#include "protocol/field/sender.h"
#include "protocol/limits.h"
#include "protocol/secrets/blake2b.h"
#include "tests/fuzz/target.h"

// Two clients share a store. They send valid and invalid parts and bricks in any order. The quotas must not be exceeded.
// A client must only be able to read its own bricks. A field must only be ready if the manifest is valid and if the
// client has uploaded all bricks. The rate of a sender must not exceed the limit.

using namespace tendon;

namespace {

constexpr std::size_t kOwners = 2;
constexpr std::size_t kQuota = 4;
constexpr std::size_t kRoom = 6;

std::vector<FieldSender::Brick> bricks_of(std::uint8_t first) {
  std::vector<FieldSender::Brick> bricks(3);
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    bricks[i].place = {static_cast<std::int32_t>(i), 0, 0};
    bricks[i].bytes.fill(static_cast<std::byte>(first + i));
  }
  return bricks;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  LocalTime now{std::chrono::seconds(1000)};
  BrickStore store(
      {.bytes = kRoom * limits::kBrickBytes, .owner_bytes = kQuota * limits::kBrickBytes, .owners = kOwners});
  std::array<FieldReceiver, kOwners> servers = {FieldReceiver({.owner = 0, .offers = 2}, store),
                                                FieldReceiver({.owner = 1, .offers = 2}, store)};
  const std::array bricks = {bricks_of(0), bricks_of(2)};  // brick 2 is in both fields
  const FieldLattice lattice{.bricks = {3, 1, 1}};
  const std::array<field::Primitive, 2> shapes = {field::Primitive{.shape = field::Sphere{.radius = 0.01}},
                                                  field::Primitive{.shape = field::Plane{}, .hollow = true}};
  std::array<FieldSender, kOwners> clients = {FieldSender({}, lattice, bricks[0]),
                                              FieldSender({}, lattice, bricks[1], shapes)};
  std::array<std::set<BrickHash>, kOwners> uploaded;
  const LocalTime start = now;

  while (!input.empty()) {
    const std::uint8_t choice = input.byte();
    const std::size_t who = choice & 1U;
    FieldReceiver& server = servers[who];
    FieldSender& client = clients[choice >> 1U & 1U];
    std::optional<FieldReceiver::Refusal> refused;
    switch (choice >> 2U & 7U) {
      case 0: {  // changes a part and its name
        std::vector<std::byte> manifest(client.manifest().begin(), client.manifest().end());
        for (std::uint8_t changes = input.byte() % 4; changes > 0; --changes) {
          manifest[input.byte() % manifest.size()] = static_cast<std::byte>(input.byte());
        }
        const bool renamed = (choice & 0x20U) != 0;
        FieldName name = renamed ? crypto::blake2b_256(manifest) : client.field();
        const std::size_t offset = input.byte();
        const auto from = std::span(manifest).subspan(std::min(offset, manifest.size()));
        const std::size_t whole = (choice & 0x40U) != 0 ? input.byte() : manifest.size();
        const auto part = from.first(std::min<std::size_t>(from.size(), input.byte()));
        refused = server.take(now, OfferField{.field = name,
                                              .size = static_cast<std::uint32_t>(whole),
                                              .offset = static_cast<std::uint32_t>(offset),
                                              .part = {part.begin(), part.end()}});
        break;
      }
      case 1: {  // an invented brick
        const auto& brick = bricks[choice >> 1U & 1U][input.byte() % 3];
        BrickBytes bytes = brick.bytes;
        const BrickHash hash = crypto::blake2b_128(bytes);
        if (const std::uint8_t change = input.byte(); change > 200) bytes[change] ^= std::byte{1};
        const std::size_t length = (choice & 0x20U) != 0 ? input.byte() : bytes.size();
        refused = server.take(now, FieldBrick{.hash = hash, .weights = std::span(bytes).first(length)});
        if (!refused) {
          fuzz::require(length == limits::kBrickBytes && (bytes == brick.bytes || uploaded[who].contains(hash)));
          uploaded[who].insert(hash);
        }
        break;
      }
      case 2: {  // a correct client sends its next part
        if (const auto part = client.next_part(now)) {
          client.part_sent();
          refused = server.take(now, *part);
        }
        break;
      }
      case 3: {  // a correct client sends its next brick, which may be lost
        const auto brick = client.next_brick(now);
        if (!brick || (choice & 0x20U) != 0) break;
        fuzz::require(brick->hash == crypto::blake2b_128(brick->weights));
        refused = server.take(now, *brick);
        if (!refused) uploaded[who].insert(brick->hash);
        break;
      }
      case 4:
        now += std::chrono::milliseconds(input.byte());
        break;
      case 5:
        now += std::chrono::seconds(input.byte() % 40);
        break;
      case 6:
        fuzz::require(server.due() == LocalTime::max() || server.offers() > 0);
        while (const auto status = server.next_status(now)) {
          fuzz::require(is_complete(*status) == server.ready(status->field).has_value());
          client.take(now, *status, std::chrono::milliseconds(input.byte()));
        }
        break;
      default:
        server.drop(client.field());
        break;
    }
    if (refused) fuzz::require(!refused->detail.empty() && refused->detail.size() <= limits::kMaxDetail);
    const double bytes = 500e3 * seconds(now - start + std::chrono::milliseconds(33)) + 1024;
    for (const FieldSender& one : clients) fuzz::require(static_cast<double>(one.sent()) * 1024 <= bytes);

    fuzz::require(store.bricks() <= kRoom);
    for (std::size_t owner = 0; owner < kOwners; ++owner) {
      fuzz::require(store.held(static_cast<BrickStore::Owner>(owner)) <= kQuota && servers[owner].offers() <= 2);
      std::size_t held = 0;
      for (const auto& hash : uploaded[owner]) {
        const BrickBytes* const found = servers[owner].brick(hash);
        held += found == nullptr ? 0 : 1;
        fuzz::require(found == nullptr || crypto::blake2b_128(*found) == hash);
      }
      fuzz::require(held == store.held(static_cast<BrickStore::Owner>(owner)));
      for (const FieldSender& one : clients) {
        const auto manifest = servers[owner].ready(one.field());
        if (!manifest) continue;
        fuzz::require(manifest->refused().empty());
        for (std::size_t i = 0; i < manifest->bricks(); ++i) {
          fuzz::require(uploaded[owner].contains(manifest->brick(i).hash));
        }
        for (std::size_t i = 0; i < manifest->primitives(); ++i) {
          const field::SurfacePoint point = distance(manifest->primitive(i), Vec3(0.01, 0.02, 0.03));
          fuzz::require(std::isfinite(point.distance) && point.gradient.allFinite());
        }
      }
    }
  }
  return 0;
}
