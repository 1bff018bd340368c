// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/injector.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace tendon::injector {
namespace {

constexpr std::array<std::string_view, 3> kVerdicts = {"pass", "drop", "dup"};
constexpr std::array<std::string_view, 12> kCauses = {"delay",  "queue",    "stall", "fifo",   "reorder", "queue-full",
                                                      "outage", "handover", "rule",  "regime", "loss",    "replay"};

template <typename Enum, std::size_t n>
std::optional<Enum> find(const std::array<std::string_view, n>& names, std::string_view text) noexcept {
  const auto found = std::ranges::find(names, text);
  if (found == names.end()) return std::nullopt;
  return static_cast<Enum>(found - names.begin());
}

const Profile& checked(const Profile& profile) {
  check(profile);
  return profile;
}

}  // namespace

std::string_view to_string(Verdict verdict) noexcept { return kVerdicts[static_cast<std::size_t>(verdict)]; }
std::string_view to_string(Cause cause) noexcept { return kCauses[static_cast<std::size_t>(cause)]; }
std::optional<Verdict> parse_verdict(std::string_view text) noexcept { return find<Verdict>(kVerdicts, text); }
std::optional<Cause> parse_cause(std::string_view text) noexcept { return find<Cause>(kCauses, text); }

Injector::Network::Network(const Profile& p)
    : profile(checked(p)),
      delay(delay_table(p.delay)),
      copula(p.rho, p.memory),
      regime_copula(p.rho, p.memory),
      loss(p.loss, Purpose::kLoss, Purpose::kLossState),
      duplicate(p.duplicate),
      replay(p.replay.probability),
      flip(p.flip),
      truncate(p.truncate),
      jump(p.jump.probability),
      has_events(!p.steps.empty() || !p.ramps.empty() || !p.spikes.empty() || !p.handovers.empty()) {
  for (const Regime& regime : p.regimes) {
    regime_delays.push_back(delay_table(regime.delay));
    regime_losses.emplace_back();
    if (regime.loss) regime_losses.back().emplace(*regime.loss, Purpose::kRegimeLoss, Purpose::kRegimeLossState);
  }
  for (const RandomOutage& outage : p.random_outages) outage_lengths.push_back(delay_table(outage.length));
  for (const DropRule& rule : p.rules) rules.emplace_back(rule.probability);
}

Injector::Injector(const Profile& profile, std::uint64_t seed, std::uint32_t link, Direction direction,
                   std::optional<LocalTime> start)
    : draws_(seed, link, direction), seed_(seed), direction_(direction), network_(profile), given_start_(start) {}

Injector Injector::for_link(std::uint32_t link) const {
  assert(!begun_);
  Injector other(*this);
  other.draws_ = Draws(seed_, link, direction_);
  return other;
}

Injector Injector::for_link(std::uint32_t link, LocalTime start) const {
  Injector other = for_link(link);
  other.given_start_ = start;
  return other;
}

std::uint64_t Injector::table_hash() const noexcept {
  std::uint64_t hash = network_.delay.hash();
  for (const auto* tables : {&network_.regime_delays, &network_.outage_lengths}) {
    for (const QuantileTable& table : *tables) hash = hash * 0x100000001b3 ^ table.hash();
  }
  return hash;
}

void Injector::begin(LocalTime start) {
  begun_ = true;
  start_ = start;
  const Profile& p = network_.profile;
  std::optional<BottleneckQueue> queue;
  if (p.bottleneck.exists()) {
    queue.emplace(p.bottleneck, start);
    if (bottleneck_) queue->continue_from(std::move(*bottleneck_));
  }
  bottleneck_ = std::move(queue);
  if (regimes_) next_visit_ = regimes_->next_visit();
  outages_.clear();
  for (const RandomOutage& outage : p.random_outages) outages_.emplace_back(outage.clear, start, outages_.size());
  regimes_.reset();
  if (!p.regimes.empty()) regimes_.emplace(p.regimes, draws_, start, next_visit_);
}

void Injector::change(const Profile& profile, LocalTime now) { adopt(Network(profile), now); }

void Injector::change(const Injector& prepared, LocalTime now) { adopt(prepared.network_, now); }

void Injector::adopt(Network next, LocalTime now) {
  next.copula.continue_from(network_.copula);
  next.regime_copula.continue_from(network_.regime_copula);
  next.loss.continue_from(network_.loss);
  if (network_.profile.rebind > Duration::zero() && begun_) {
    rebinds_before_ += static_cast<std::uint32_t>(std::max(Duration::zero(), now - start_) / network_.profile.rebind);
  }
  network_ = std::move(next);
  begin(now);
}

LocalTime Injector::past_stalls(LocalTime at) const {
  if (network_.profile.stalls.empty()) return at;
  return start_ + injector::past_stalls(network_.profile, at - start_);
}

std::optional<Cause> Injector::cause_of_loss(const Packet& packet, std::uint64_t index,
                                             std::optional<std::size_t> regime) {
  const Profile& p = network_.profile;
  // The profile's loss chain advances with every datagram, a regime's chain only while the regime is active.
  LossModel* const special = regime && network_.regime_losses[*regime] ? &*network_.regime_losses[*regime] : nullptr;
  const bool plain_lost = network_.loss.lost(draws_, index);
  const bool lost = special != nullptr ? special->lost(draws_, index) : plain_lost;
  bool outage = false;
  for (std::size_t i = 0; i < outages_.size(); ++i) {
    outage = outages_[i].end(packet.arrival, network_.outage_lengths[i], draws_) || outage;
  }

  const Duration since = packet.arrival - start_;
  if (outage || in_outage(p, since)) return Cause::kOutage;
  if (in_handover(p, since)) return Cause::kHandover;
  for (std::size_t i = 0; i < p.rules.size(); ++i) {
    const DropRule& rule = p.rules[i];
    if (packet.bytes.size() <= rule.byte) continue;
    if ((std::to_integer<std::uint8_t>(packet.bytes[rule.byte]) & rule.mask) != rule.value) continue;
    const auto purpose = static_cast<Purpose>(static_cast<std::uint32_t>(Purpose::kRule) + i);
    if (network_.rules[i].happens(draws_(purpose, index))) return Cause::kRule;
  }
  if (!lost) return std::nullopt;
  return special != nullptr ? Cause::kRegime : Cause::kLoss;
}

Decision Injector::decide(const Packet& packet) {
  if (!begun_) begin(given_start_.value_or(packet.arrival));
  const Profile& p = network_.profile;
  const std::uint64_t index = next_index_++;
  const LocalTime arrival = packet.arrival;
  Decision d;
  d.index = index;
  d.arrival = d.release = arrival;
  d.size = packet.size;

  // Delays are drawn before the queue can drop the datagram, so that the bottleneck does not shift any draw.
  const std::optional<std::size_t> regime = regimes_ ? std::optional(regimes_->at(arrival)) : std::nullopt;
  const auto drawn = [&](const QuantileTable& table, Copula& copula, Purpose purpose) {
    if (table.constant()) return Duration(table(0));
    const std::uint64_t draw = draws_(purpose, index);
    return Duration(table(copula.trivial() ? draw : copula.next(draw, arrival)));
  };
  const Duration own = drawn(network_.delay, network_.copula, Purpose::kDelay);
  Duration common = p.base;
  if (regime) common += drawn(network_.regime_delays[*regime], network_.regime_copula, Purpose::kRegimeDelay);
  if (network_.has_events) common += extra_delay(p, arrival - start_, draws_);
  const std::optional<Cause> loss = cause_of_loss(packet, index, regime);
  if (p.rebind > Duration::zero()) {
    d.rebinds = static_cast<std::uint32_t>(std::max(Duration::zero(), arrival - start_) / p.rebind);
  }
  d.rebinds += rebinds_before_;

  LocalTime sent = arrival;
  if (bottleneck_) {
    const std::optional<LocalTime> passed = bottleneck_->pass(arrival, packet.size);
    if (!passed) {
      d.verdict = Verdict::kDrop;
      d.cause = Cause::kQueueFull;
      releases_[index % kMaxJump] = last_release_;
      return d;
    }
    sent = *passed;
    d.cause = Cause::kQueue;
  }
  const auto leaves = [&](Duration delay) { return sent + std::clamp(common + delay, Duration::zero(), kMaxDelay); };

  d.release = leaves(own);
  if (const LocalTime later = past_stalls(d.release); later > d.release) {
    d.release = later;
    d.cause = Cause::kStall;
  }
  if (p.order == Order::kFifo && last_release_ > d.release) {
    d.release = last_release_;
    d.cause = Cause::kFifo;
  }
  last_release_ = std::max(last_release_, d.release);
  releases_[index % kMaxJump] = d.release;
  if (p.jump.places > 0 && network_.jump.happens(draws_(Purpose::kJump, index))) {
    for (std::uint64_t back = std::min<std::uint64_t>(index, p.jump.places); back > 0; --back) {
      const LocalTime ahead = releases_[(index - back) % kMaxJump] - Duration(1);
      if (ahead < sent + p.base || ahead >= d.release) continue;
      d.release = ahead;
      d.cause = Cause::kReorder;
      break;
    }
  }

  if (p.replay.depth > 0 && index > 0 && network_.replay.happens(draws_(Purpose::kReplay, index))) {
    const std::uint64_t reach = std::min<std::uint64_t>(index, p.replay.depth);
    const auto back = static_cast<std::uint32_t>(1 + one_of(reach, draws_(Purpose::kReplayAge, index)));
    d.stale = Decision::Stale{d.release, back};
  }
  if (loss) {
    d.verdict = Verdict::kDrop;
    d.cause = *loss;
    return d;
  }
  if (network_.duplicate.possible() && network_.duplicate.happens(draws_(Purpose::kDuplicate, index))) {
    d.verdict = Verdict::kDuplicate;
    const Duration again(network_.delay(draws_(Purpose::kDuplicateDelay, index)));
    d.duplicate = std::max(d.release, past_stalls(leaves(again)));
  }
  if (packet.size > 0) {
    if (network_.flip.possible() && network_.flip.happens(draws_(Purpose::kFlip, index))) {
      d.flipped_bit =
          static_cast<std::uint32_t>(one_of(std::uint64_t{packet.size} * 8, draws_(Purpose::kFlipWhere, index)));
    }
    if (network_.truncate.possible() && network_.truncate.happens(draws_(Purpose::kTruncate, index))) {
      d.truncated_to = static_cast<std::uint32_t>(one_of(packet.size, draws_(Purpose::kTruncateWhere, index)));
    }
  }
  return d;
}

}  // namespace tendon::injector
