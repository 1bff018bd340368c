// SPDX-License-Identifier: Apache-2.0
#include "protocol/field/sender.h"

#include <algorithm>

#include "core/base/expect.h"
#include "protocol/secrets/blake2b.h"

namespace tendon {
namespace {

/// Beyond the round trip, for jitter.
constexpr Duration kJitterOfStatus = std::chrono::milliseconds(10);

}  // namespace

FieldSender::FieldSender(const Config& config, const FieldLattice& lattice, std::span<const Brick> bricks,
                         std::span<const field::Primitive> primitives)
    : config_(config), bricks_(bricks), sent_at_(bricks.size(), kNever), pace_(config.bytes_per_s, config.burst) {
  expect_above_zero(seconds(config.silence), "silence_s");
  std::vector<PlacedBrick> placed;
  placed.reserve(bricks.size());
  for (const Brick& one : bricks) {
    placed.push_back({.place = one.place, .material = one.material, .hash = crypto::blake2b_128(one.bytes)});
  }
  manifest_ = encode_manifest(lattice, placed, primitives);
  field_ = crypto::blake2b_256(manifest_);
}

std::optional<OfferField> FieldSender::next_part(LocalTime now) {
  if (heard_ == kNever) heard_ = now;
  if (offered_ == manifest_.size() && !complete_ && now - heard_ >= config_.silence) {
    offered_ = 0;
    heard_ = now;
  }
  const std::size_t length = std::min(manifest_.size() - offered_, limits::kMaxFieldPart);
  if (length == 0) return {};
  const auto part = std::span<const std::byte>(manifest_).subspan(offered_, length);
  return OfferField{.field = field_,
                    .size = static_cast<std::uint32_t>(manifest_.size()),
                    .offset = static_cast<std::uint32_t>(offered_),
                    .part = {part.begin(), part.end()}};
}

void FieldSender::part_sent() noexcept { offered_ += std::min(manifest_.size() - offered_, limits::kMaxFieldPart); }

bool FieldSender::take(LocalTime now, const FieldStatus& status, Duration round_trip) noexcept {
  if (status.field != field_) return false;
  status_ = status;
  heard_ = now;
  arrived_before_ = now - round_trip - round_trip / 8 - kJitterOfStatus;
  complete_ = is_complete(status);
  return true;
}

/// Returns the oldest lost brick, or otherwise the first brick that was not sent yet.
std::optional<std::size_t> FieldSender::choice() const noexcept {
  if (!status_ || complete_) return {};
  std::optional<std::size_t> lost;
  std::optional<std::size_t> fresh;
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    if (!misses(*status_, i) || sent_at_[i] >= arrived_before_) continue;
    auto& found = sent_at_[i] == kNever ? fresh : lost;
    if (!found || sent_at_[i] < sent_at_[*found]) found = i;
  }
  return lost ? lost : fresh;
}

std::optional<FieldBrick> FieldSender::next_brick(LocalTime now) noexcept {
  if (pace_.next() > now) return {};
  const auto i = choice();
  if (!i) return {};
  pace_.pass(now);
  sent_at_[*i] = now;
  ++sent_;
  FieldBrick brick{.hash = {}, .weights = bricks_[*i].bytes};
  std::ranges::copy(FieldManifest(manifest_).hash(*i), brick.hash.begin());
  return brick;
}

LocalTime FieldSender::due() const noexcept {
  if (offered_ < manifest_.size()) return LocalTime::min();
  if (complete_) return LocalTime::max();
  const LocalTime again = heard_ + config_.silence;
  return choice() ? std::min(again, pace_.next()) : again;
}

}  // namespace tendon
