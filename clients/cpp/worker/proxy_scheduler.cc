// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/worker/proxy_scheduler.h"

#include <algorithm>
#include <utility>

#include "protocol/expect.h"

namespace tendon::worker {
namespace {

const ProxyScheduler::Config& checked(const ProxyScheduler::Config& config) {
  const auto positive = [](const char* name, Duration value) {
    expect(value > Duration::zero(), name, seconds(value), "a time > 0");
  };
  expect(config.deadline >= Duration::zero(), "deadline", seconds(config.deadline), "a time >= 0");
  expect(config.dead >= Duration::zero(), "dead", seconds(config.dead), "a time >= 0");
  positive("start", config.start);
  positive("retry_min", config.retry_min);
  expect(config.retry_max >= config.retry_min, "retry_max", seconds(config.retry_max), "at least retry_min");
  return config;
}

bool has_force(const Touch& touch) {
  return !touch.force.isZero(0) || (touch.torque && !touch.torque->isZero(0)) || touch.grip_force.value_or(0) != 0;
}

}  // namespace

ProxyScheduler::ProxyScheduler(const Config& config, LocalTime now)
    : config_(checked(config)), due_(now), wait_(config.retry_min) {}

void ProxyScheduler::see(const Seen& seen) {
  newest_ = seen;
  newest_answered_ = false;
}

void ProxyScheduler::opened() {
  if (worker_ == Worker::kStarting) worker_ = Worker::kIdle;
}

void ProxyScheduler::answered(LocalTime now, const Touch& touch) {
  if (worker_ != Worker::kBusy) return;
  const Duration took = now - asked_;
  const bool late = took > deadline();
  if (has_force(touch)) times_[count_++ % kTimes] = took;
  worker_ = Worker::kIdle;
  if (!first_answer_) first_answer_ = now;
  if (now - *first_answer_ > wait_) wait_ = config_.retry_min;
  if (late) {
    ++stats_.late;
    return;
  }
  ++stats_.answers;
  if (touch.unknown) {
    ++stats_.unknown;
    return;
  }
  if (config_.fallback) {
    const Touch guess = config_.fallback(question_.hand);
    if (!guess.unknown) stats_.fallback_difference = (guess.force - touch.force).norm();
  }
  answer_ = Reply{.to = question_, .touch = touch};
  if (const Duration usual = 3 * median(); usual > kMinDeadline) answer_->touch.valid_for = usual;
}

void ProxyScheduler::refused(std::string_view why) {
  ++stats_.refused;
  stats_.why_refused = why;
}

void ProxyScheduler::ended(LocalTime now, const std::string& why) {
  if (worker_ != Worker::kAbsent) give_up(now, why);
}

void ProxyScheduler::give_up(LocalTime now, const std::string& why) {
  worker_ = Worker::kAbsent;
  due_ = now + wait_;
  wait_ = std::min(2 * wait_, config_.retry_max);
  first_answer_.reset();
  ++stats_.given_up;
  stats_.why_given_up = why;
  to_give_up_ = why;
}

std::optional<ProxyScheduler::Order> ProxyScheduler::turn(LocalTime now) {
  if (worker_ == Worker::kBusy && now - asked_ > dead()) {
    give_up(now, "it has not replied for " + std::to_string(dead() / std::chrono::milliseconds(1)) + " ms");
  }
  if (worker_ == Worker::kStarting && now >= due_) {
    give_up(now, "it has not connected within " + std::to_string(config_.start / std::chrono::seconds(1)) +
                     " s after its start");
  }
  if (to_give_up_) return GiveUp{*std::exchange(to_give_up_, std::nullopt)};
  if (worker_ == Worker::kAbsent && now >= due_) {
    worker_ = Worker::kStarting;
    due_ = now + config_.start;
    ++stats_.launches;
    return Launch{};
  }
  if (answer_) return *std::exchange(answer_, std::nullopt);
  if (worker_ == Worker::kIdle && newest_) {
    worker_ = Worker::kBusy;
    asked_ = now;
    question_ = *std::exchange(newest_, std::nullopt);
    ++stats_.asked;
    return Ask{.sequence = ++sequence_, .hand = question_.hand};
  }
  return fall_back(now);
}

std::optional<ProxyScheduler::Order> ProxyScheduler::fall_back(LocalTime now) {
  const bool able = worker_ == Worker::kIdle || (worker_ == Worker::kBusy && !overdue(now));
  if (!config_.fallback || able || !newest_ || newest_answered_) return std::nullopt;
  newest_answered_ = true;
  Touch touch = config_.fallback(newest_->hand);
  if (touch.unknown) return std::nullopt;
  touch.error = touch.error.value_or(0) + stats_.fallback_difference;
  ++stats_.fallback;
  return Reply{.to = *newest_, .touch = touch};
}

LocalTime ProxyScheduler::next_turn() const {
  if (to_give_up_ || answer_) return LocalTime::min();
  switch (worker_) {
    case Worker::kAbsent:
    case Worker::kStarting:
      return due_;
    case Worker::kIdle:
      return newest_ ? LocalTime::min() : LocalTime::max();
    case Worker::kBusy:
      break;
  }
  const LocalTime end = asked_ + dead() + Duration(1);
  return config_.fallback && newest_ && !newest_answered_ ? std::min(end, asked_ + deadline() + Duration(1)) : end;
}

Duration ProxyScheduler::deadline() const {
  return config_.deadline > Duration::zero() ? config_.deadline : std::max(3 * median(), kMinDeadline);
}

Duration ProxyScheduler::dead() const {
  if (config_.dead > Duration::zero()) return config_.dead;
  return count_ == 0 ? kDeadAtFirst : std::max(10 * median(), kMinDead);
}

Duration ProxyScheduler::median() const {
  const std::size_t known = std::min(count_, kTimes);
  if (known == 0) return {};
  std::array<Duration, kTimes> sorted = times_;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(known / 2);
  std::nth_element(sorted.begin(), middle, sorted.begin() + static_cast<std::ptrdiff_t>(known));
  return *middle;
}

ProxyScheduler::Stats ProxyScheduler::stats() const {
  Stats stats = stats_;
  stats.worker = worker_;
  stats.median = median();
  return stats;
}

}  // namespace tendon::worker
