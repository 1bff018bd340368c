// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/methods/playout_clock.h"

#include <algorithm>

namespace tendon {

void PlayoutClock::heard(Duration now, Duration time, Duration waited) noexcept {
  if (halves_[0].count == kHalf) {
    halves_[1] = halves_[0];
    halves_[0] = Half{};
  }
  Half& half = halves_[0];
  const Duration way = now - time;
  half.least = std::min(half.least, way);
  newest_ = std::max(newest_, time);

  Duration rising = way + std::max(waited, Duration::zero());
  const std::size_t kept = std::min(static_cast<std::size_t>(half.count), kLargest);
  for (std::size_t i = 0; i < kept; ++i) {
    if (rising > half.largest[i]) std::swap(rising, half.largest[i]);
  }
  if (kept < kLargest) half.largest[kept] = rising;
  ++half.count;
}

Duration PlayoutClock::least() const noexcept { return std::min(halves_[0].least, halves_[1].least); }

Duration PlayoutClock::playout() const noexcept {
  const int count = halves_[0].count + halves_[1].count;
  if (count == 0) return Duration::zero();
  // The (count / 100)-th largest delay of both intervals, counted from 0, since 1 % may be late.
  std::array<std::size_t, 2> at{};
  const auto has = [&](std::size_t h) {
    return at[h] < std::min(static_cast<std::size_t>(halves_[h].count), kLargest);
  };
  Duration quantile = least();
  for (int left = count / 100; left >= 0 && (has(0) || has(1)); --left) {
    const std::size_t from = !has(1) || (has(0) && halves_[0].largest[at[0]] >= halves_[1].largest[at[1]]) ? 0 : 1;
    quantile = halves_[from].largest[at[from]++];
  }
  return std::min(quantile - least(), max_playout_);
}

Duration PlayoutClock::advance(Duration now) noexcept {
  const Duration passed = std::max(now - now_, Duration::zero());
  now_ = now;
  if (halves_[0].count == 0) return playing_;
  const Duration target = now - least() - playout();
  if (!started_) {
    started_ = true;
    return playing_ = std::min(target, newest_);
  }
  const Duration lag = target - (playing_ + passed);
  const double rate = std::clamp(1 + seconds(lag) / kSteering, 0.0, 2.0);
  const Duration latest = std::max(newest_, now - least() - max_playout_);
  return playing_ = std::max(playing_, std::min(playing_ + from_seconds(rate * seconds(passed)), latest));
}

}  // namespace tendon
