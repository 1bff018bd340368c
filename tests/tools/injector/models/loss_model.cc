// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/loss_model.h"

#include "tests/tools/injector/models/exact_math.h"

namespace tendon::injector {
namespace {

constexpr int kLengthBits = 16;
constexpr std::int64_t kMaxBurst = 1'000'000;

/// Before rounding down to whole datagrams.
QuantileTable burst_lengths(const ParetoBurstLoss::Length& law) {
  return tabulate(
      [&](double, double q) {
        return law.scale * (exact::exp(-exact::log(q) / law.shape) - 1) * (std::int64_t{1} << kLengthBits);
      },
      0, kMaxBurst << kLengthBits);
}

}  // namespace

LossModel::LossModel(const Loss& loss, Purpose event, Purpose state) : event_(event), state_draw_(state) {
  const auto two_state = [this](double p, double r, double lost_in_bad, double lost_in_good) {
    kind_ = Kind::kTwoState;
    rows_[0] = {Chance(1 - p), kSure, kSure};
    rows_[1] = {Chance(r), kSure, kSure};
    loss_in_[0] = Chance(lost_in_good);
    loss_in_[1] = Chance(lost_in_bad);
    const double bad = p + r > 0 ? p / (p + r) : 0;
    stationary_ = {Chance(1 - bad), kSure, kSure};
  };
  if (const auto* random = std::get_if<RandomLoss>(&loss)) {
    random_ = Chance(random->probability);
    kind_ = random_.possible() ? Kind::kRandom : Kind::kNever;
  } else if (const auto* burst = std::get_if<BurstLoss>(&loss)) {
    two_state(burst->probability / (1 - burst->probability) / burst->length, 1 / burst->length, 1, 0);
  } else if (const auto* gilbert = std::get_if<GilbertLoss>(&loss)) {
    two_state(gilbert->to_bad, gilbert->to_good, gilbert->lost_in_bad, gilbert->lost_in_good);
  } else if (const auto* four = std::get_if<FourStateLoss>(&loss)) {
    const auto& [p13, p31, p32, p23, p14] = *four;
    kind_ = Kind::kFourState;
    const Chance stay(1 - p13 - p14);
    rows_[0] = {stay, stay, Chance(1 - p14)};
    rows_[1] = {Chance(0), Chance(1 - p23), kSure};
    rows_[2] = {Chance(p31), Chance(p31 + p32), kSure};
    rows_[3] = {kSure, kSure, kSure};
    loss_in_[2] = loss_in_[3] = Chance(1);
    const double d = p23 * p31 + p13 * p23 + p13 * p32 + p14 * p23 * p31;
    // If p13 = 0, there are no bursts, and states 2 and 3 are unreachable for every p23 and p31.
    const double gap = p13 > 0 ? p23 * p31 / d : 1 / (1 + p14);
    const double alone = gap * p14;
    const double received = p13 > 0 ? p13 * p32 / d : 0;
    stationary_ = {Chance(gap), Chance(gap + received), alone > 0 ? Chance(1 - alone) : kSure};
  } else if (const auto* bursts = std::get_if<ParetoBurstLoss>(&loss)) {
    two_state(bursts->p12, bursts->p21, 0, 0);
    kind_ = Kind::kBursts;
    for (const auto& law : bursts->lengths) lengths_.push_back(burst_lengths(law));
  } else {
    kind_ = Kind::kPattern;
    for (const char digit : std::get<PatternLoss>(loss).pattern) pattern_.push_back(digit == '1');
  }
}

bool LossModel::lost(const Draws& draws, std::uint64_t index) noexcept {
  switch (kind_) {
    case Kind::kNever:
      return false;
    case Kind::kRandom:
      return random_.happens(draws(event_, index));
    case Kind::kPattern:
      return pattern_[index % pattern_.size()];
    case Kind::kTwoState:
    case Kind::kFourState:
    case Kind::kBursts:
      break;
  }
  const Row& row = state_ == kUnborn ? stationary_ : rows_[state_];
  const std::uint64_t draw = draws(state_draw_, index);
  std::uint8_t next = 0;
  while (next < 3 && !row[next].happens(draw)) ++next;
  state_ = next;
  if (kind_ == Kind::kBursts) return in_burst(draws, index);
  const Chance& loss = loss_in_[state_];
  return loss.possible() && loss.happens(draws(event_, index));
}

bool LossModel::in_burst(const Draws& draws, std::uint64_t index) noexcept {
  if (burst_ < 0) burst_ = lengths_[state_](draws(event_, index)) >> kLengthBits;
  return burst_-- > 0;
}

void LossModel::continue_from(const LossModel& before) noexcept {
  if (kind_ != before.kind_) return;
  state_ = before.state_;
  burst_ = before.burst_;
}

}  // namespace tendon::injector
