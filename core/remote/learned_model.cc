// SPDX-License-Identifier: Apache-2.0
#include "core/remote/learned_model.h"

#include <algorithm>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kOtherSide = 3e-4;   // m: a zero force at this distance from the last push ends the contact
constexpr double kSameObject = 3e-3;  // m: if a force reverses within this distance, it belongs to the same object
constexpr double kBeyond = 1.5;       // limit of predictions, in F_late
constexpr double kOfLate = 1;         // s, time constant of F_late
constexpr double kOfTheNewGap = 0.2;  // weight of a new value when the mean time between answers is updated

}  // namespace

LearnedModel::LearnedModel(const Config& config) : config_(config) {
  expect_above_zero(config.least_travel, "least_travel");
  expect(config.gain > 0 && config.gain <= 1, "gain", config.gain, "a number above 0, at most 1");
  expect(config.forgetting > 0 && config.forgetting < 1, "forgetting", config.forgetting, "a number between 0 and 1");
  expect_above_zero(config.max_stiffness, "max_stiffness");
  expect_not_negative(seconds(config.blend), "blend");
  expect_not_negative(config.blend_share, "blend_share");
}

void LearnedModel::observe(const Motion& hand) noexcept {
  if (!hand.position.allFinite()) return;
  if (next_ > 0 && hand.at <= newest().at) return;
  places_[next_ % kSlots] = {hand.at, hand.position};
  ++next_;
}

/// Returns the position of the hand in the last step not after `at`. The time stamps in the ring increase.
std::optional<Vec3> LearnedModel::place_at(LocalTime at) const noexcept {
  std::uint64_t low = next_ > kSlots ? next_ - kSlots : 0;
  std::uint64_t high = next_;
  const std::uint64_t oldest = low;
  while (low < high) {
    const std::uint64_t middle = low + (high - low) / 2;
    if (places_[middle % kSlots].at <= at) {
      low = middle + 1;
    } else {
      high = middle;
    }
  }
  if (low == oldest) return std::nullopt;
  return places_[(low - 1) % kSlots].position;
}

void LearnedModel::judge_sides(const Answered& answer) noexcept {
  if (answer.force.isZero(0)) {
    if (!pushed_) pushed_ = answer;
    if ((answer.place - pushed_->place).norm() > kOtherSide) one_sided_ = true;
    return;
  }
  if (pushed_ && answer.force.dot(pushed_->force) < 0 && (answer.place - pushed_->place).norm() < kSameObject) {
    one_sided_ = false;
  }
  pushed_ = answer;
}

void LearnedModel::learn(const Answered& answer) noexcept {
  if (!teacher_ || (one_sided_ && (answer.force.isZero(0) || teacher_->force.isZero(0)))) {
    teacher_ = answer;
    return;
  }
  const Vec3 travel = answer.place - teacher_->place;
  const double least = config_.least_travel * config_.least_travel;
  const double squared = travel.squaredNorm();
  if (squared < least) return;
  const Vec3 change = teacher_->force - answer.force;
  const Vec3 said = stiffness_ * travel;
  came_ = config_.forgetting * came_ + change.dot(said);
  predicted_ = config_.forgetting * predicted_ + said.squaredNorm();
  stiffness_ += (config_.gain / (squared + least / 10)) * (change - said) * travel.transpose();
  teacher_ = answer;
  if (lessons_ < 2) ++lessons_;
  trust_ = lessons_ == 2 && predicted_ > 0 ? std::clamp(came_ / predicted_, 0.0, 1.0) : 0.0;
}

void LearnedModel::correct(const RemoteForce& answer) noexcept {
  const std::optional<Vec3> place = place_at(answer.answers);
  const Vec3 before = anchor_ ? Vec3(led().force + rest_) : Vec3(answer.force);
  if (anchor_) {
    const double gap = seconds(answer.received - answered_);
    gap_ = gap_ ? *gap_ + kOfTheNewGap * (gap - *gap_) : gap;
    largest_ *= kOfLate / (kOfLate + std::max(0.0, gap));
  }
  largest_ = std::max(largest_, answer.force.norm());
  answered_ = answer.received;
  anchor_ = Answered{answer.force, place.value_or(Vec3::Zero())};
  known_place_ = place.has_value();
  if (known_place_) {
    judge_sides(*anchor_);
    learn(*anchor_);
  }
  rest_ = before - led().force;
}

/// Returns the anchor, moved to the newest position.
Prediction LearnedModel::led() const noexcept {
  Prediction result{.force = anchor_->force, .stiffness = Mat3::Zero()};
  if (!known_place_ || trust_ == 0 || (one_sided_ && anchor_->force.isZero(0))) return result;
  const Vec3 travel = newest().position - anchor_->place;
  Vec3 change = trust_ * (stiffness_ * travel);
  const double most = config_.max_stiffness * travel.norm();
  const double size = change.norm();
  double share = trust_;
  if (size > most) {
    change *= most / size;
    share *= most / size;
  }
  result.force -= change;
  if (one_sided_) {
    const double along = result.force.dot(anchor_->force);
    if (along < 0) {
      result.force -= along / anchor_->force.squaredNorm() * anchor_->force;
      return result;
    }
  }
  if (const double led = result.force.norm(); led > kBeyond * largest_) {
    result.force *= kBeyond * largest_ / led;
    return result;
  }
  result.stiffness = share * stiffness_;
  return result;
}

std::optional<Prediction> LearnedModel::predict() noexcept {
  if (!anchor_ || next_ == 0) return std::nullopt;
  const double elapsed = std::max(0.0, seconds(newest().at - faded_));
  faded_ = newest().at;
  const double blend = std::min(seconds(config_.blend), config_.blend_share * gap_.value_or(0));
  rest_ *= blend > 0 ? blend / (blend + elapsed) : 0.0;
  Prediction result = led();
  result.force += rest_;
  return result;
}

void LearnedModel::forget() noexcept {
  stiffness_.setZero();
  came_ = predicted_ = trust_ = 0;
  lessons_ = 0;
  teacher_.reset();
  pushed_.reset();
  one_sided_ = false;
  anchor_.reset();
  rest_.setZero();
  largest_ = 0;
  gap_.reset();
}

}  // namespace tendon
