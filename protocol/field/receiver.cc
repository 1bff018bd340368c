// SPDX-License-Identifier: Apache-2.0
#include "protocol/field/receiver.h"

#include <algorithm>

#include "core/base/expect.h"
#include "protocol/limits.h"
#include "protocol/secrets/blake2b.h"

namespace tendon {
namespace {

using FieldRefusal = FieldReceiver::Refusal;

constexpr int kReadyCopies = 5;  ///< with 5 % loss, all of them are lost in one of 3 million uploads
constexpr Duration kReadyPeriod = std::chrono::seconds(1);

FieldRefusal refuse_field(const FieldName& field, Code code, const std::string& why) {
  return {.code = code, .detail = "field " + short_name(field) + ": " + why};
}
FieldRefusal refuse_brick(const FieldBrick& brick, Code code, const std::string& why) {
  return {.code = code, .detail = "brick " + short_name(brick.hash) + ": " + why};
}
/// Null if the field is not offered.
template <class Offers>
auto* offer_of(Offers& offers, const FieldName& field) noexcept {
  const auto found = std::ranges::find_if(offers, [&](const auto& one) { return one.open && one.field == field; });
  return found == offers.end() ? nullptr : &*found;
}
std::string number_of(const char* name, std::size_t value, const std::string& expected) {
  return std::string(name) + " = " + std::to_string(value) + ": expected " + expected;
}

}  // namespace

FieldReceiver::FieldReceiver(const Config& config, BrickStore& store)
    : config_(config), store_(store), offers_(config.offers), pace_(config.bytes_per_s, config.burst) {
  expect(config.owner < store.owners(), "owner", config.owner, "below " + std::to_string(store.owners()));
  expect(config.offers > 0, "offers", static_cast<double>(config.offers), "1 or more");
  expect_above_zero(seconds(config.period), "period_s");
  expect_above_zero(seconds(config.expiry), "expiry_s");
  for (Offer& offer : offers_) offer.bytes.resize(FieldManifest::kMost);
}

std::optional<FieldRefusal> FieldReceiver::take(LocalTime now, const OfferField& part) {
  expire(now);
  if (auto refused = refuse_part(part)) return refused;
  Offer* offer = offer_of(offers_, part.field);
  if (offer == nullptr) {
    const auto unused = std::ranges::find(offers_, false, &Offer::open);
    unused->open = true;
    unused->field = part.field;
    unused->size = part.size;
    unused->received = 0;
    unused->ready = false;
    unused->missing = 0;
    unused->status_due = now;
    offer = &*unused;
  } else if (part.offset < offer->received) {
    offer->told = 0;  // the client has not received a status
    offer->status_due = std::min(offer->status_due, now + config_.period);
    return {};
  }
  const bool had_head = offer->manifest().has_head();
  std::ranges::copy(part.part, offer->bytes.begin() + static_cast<std::ptrdiff_t>(offer->received));
  offer->received += part.part.size();
  offer->progress = now;
  std::optional<Refusal> refused;
  if (!had_head && offer->manifest().has_head()) refused = refuse_head(*offer);
  if (!refused && offer->whole()) refused = refuse_whole(*offer);
  if (refused) {
    offer->open = false;
    return refused;
  }
  return {};
}

std::optional<FieldRefusal> FieldReceiver::refuse_part(const OfferField& part) const {
  const auto refuse = [&](const char* name, std::size_t value, const std::string& expected) {
    return refuse_field(part.field, Code::kInvalid, number_of(name, value, expected));
  };
  if (part.size < FieldManifest::kLeast || part.size > FieldManifest::kMost) {
    return refuse("size", part.size,
                  std::to_string(FieldManifest::kLeast) + " … " + std::to_string(FieldManifest::kMost) + " bytes");
  }
  if (part.offset >= part.size) return refuse("offset", part.offset, "below " + std::to_string(part.size));
  const std::size_t most = std::min<std::size_t>(limits::kMaxFieldPart, part.size - part.offset);
  if (part.part.empty() || part.part.size() > most) {
    return refuse("part", part.part.size(), "1 … " + std::to_string(most));
  }
  const Offer* const offer = offer_of(offers_, part.field);
  if (offer != nullptr && part.size != offer->size) return refuse("size", part.size, std::to_string(offer->size));
  const std::size_t next = offer == nullptr ? 0 : offer->received;
  if (part.offset > next) return refuse("offset", part.offset, "at most " + std::to_string(next));
  if (offer == nullptr && offers() == offers_.size()) {
    return refuse_field(part.field, Code::kBusy,
                        number_of("offers", offers() + 1, "at most " + std::to_string(offers())));
  }
  return {};
}

std::optional<FieldRefusal> FieldReceiver::refuse_head(const Offer& offer) const {
  const FieldManifest manifest = offer.manifest();
  if (const std::string why = manifest.refused_head(); !why.empty()) {
    return refuse_field(offer.field, Code::kInvalid, why);
  }
  if (offer.size != manifest.size()) {
    return refuse_field(offer.field, Code::kInvalid,
                        number_of("size", offer.size, std::to_string(manifest.size()) + " bytes"));
  }
  std::size_t bricks = 0;
  for (const Offer& one : offers_) bricks += one.open ? one.manifest().bricks() : 0;
  if (bricks > store_.quota()) {
    const std::string most = "at most " + std::to_string(store_.quota()) + " of all fields of a client";
    return refuse_field(offer.field, Code::kBusy, number_of("bricks", bricks, most));
  }
  return {};
}

std::optional<FieldRefusal> FieldReceiver::refuse_whole(const Offer& offer) const {
  const auto hash = crypto::blake2b_256(std::span(offer.bytes).first(offer.size));
  if (hash != offer.field) {
    return refuse_field(offer.field, Code::kInvalid, "the manifest has the hash " + short_name(hash));
  }
  const std::string why = offer.manifest().refused();
  if (why.empty()) return {};
  return refuse_field(offer.field, Code::kInvalid, why);
}

std::optional<FieldRefusal> FieldReceiver::take(LocalTime now, const FieldBrick& brick) {
  expire(now);
  if (brick.weights.size() != limits::kBrickBytes) {
    return refuse_brick(brick, Code::kInvalid, number_of("weights", brick.weights.size(), "1024"));
  }
  if (!pace_.pass(now)) {  // checked first because it is cheap
    return refuse_brick(brick, Code::kBusy, "expected at most " + shortest(config_.bytes_per_s) + " bytes per second");
  }
  bool offered = false;
  const bool known = store_.find(config_.owner, brick.hash) != nullptr;
  const auto for_each_place = [&](auto visit) {
    for (Offer& offer : offers_) {
      if (!offer.open) continue;
      const FieldManifest manifest = offer.manifest();
      for (std::size_t i = 0; i < manifest.known(); ++i) {
        if (std::ranges::equal(manifest.hash(i), brick.hash)) visit(offer);
      }
    }
  };
  for_each_place([&](const Offer&) { offered = true; });
  if (!offered) return refuse_brick(brick, Code::kInvalid, "expected a brick of an offered field");
  if (known) return {};
  const auto hash = crypto::blake2b_128(brick.weights);
  if (hash != brick.hash) return refuse_brick(brick, Code::kInvalid, "the bytes have the hash " + short_name(hash));
  store_.put(config_.owner, brick.hash, brick.weights.first<limits::kBrickBytes>());
  for_each_place([&](Offer& offer) {
    offer.progress = now;
    offer.missing -= offer.missing > 0 ? 1 : 0;
    if (offer.missing == 0 && offer.whole()) offer.status_due = std::min(offer.status_due, now);
  });
  return {};
}

std::optional<FieldStatus> FieldReceiver::next_status(LocalTime now) {
  expire(now);
  for (Offer& offer : offers_) {
    if (!offer.open || offer.status_due > now) continue;
    FieldStatus status{.field = offer.field};
    const FieldManifest manifest = offer.manifest();
    offer.missing = 0;
    for (std::size_t i = 0; i < manifest.known(); ++i) {
      if (store_.use(config_.owner, manifest.hash(i))) continue;  // and keep it
      miss(status, i);
      ++offer.missing;
    }
    if (!offer.whole()) miss(status, kManifestBit);
    offer.ready = is_complete(status);
    if (offer.ready) offer.progress = now;
    offer.told = offer.ready ? std::min(offer.told + 1, kReadyCopies) : 0;
    offer.status_due = now + (offer.told < kReadyCopies ? config_.period : kReadyPeriod);
    return status;
  }
  return {};
}

LocalTime FieldReceiver::due() const noexcept {
  LocalTime next = LocalTime::max();
  for (const Offer& offer : offers_) {
    if (offer.open) next = std::min(next, offer.status_due);
  }
  return next;
}

std::optional<FieldManifest> FieldReceiver::ready(const FieldName& field) const noexcept {
  const Offer* const offer = offer_of(offers_, field);
  if (offer == nullptr || !offer->ready) return {};
  return offer->manifest();
}

bool FieldReceiver::has(const FieldName& field) const noexcept { return offer_of(offers_, field) != nullptr; }

bool FieldReceiver::drop(const FieldName& field) noexcept {
  Offer* const offer = offer_of(offers_, field);
  if (offer != nullptr) offer->open = false;
  return offer != nullptr;
}

std::size_t FieldReceiver::offers() const noexcept {
  return static_cast<std::size_t>(std::ranges::count(offers_, true, &Offer::open));
}

void FieldReceiver::expire(LocalTime now) noexcept {
  for (Offer& offer : offers_) {
    if (offer.open && !offer.ready && now - offer.progress >= config_.expiry) offer.open = false;
  }
}

}  // namespace tendon
