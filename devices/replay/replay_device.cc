// SPDX-License-Identifier: Apache-2.0
#include "devices/replay/replay_device.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kLongest_s = 1e9;  // 30 years; twice this can still be represented

}  // namespace

ReplayDevice::ReplayDevice(Config config) : config_(std::move(config)) {
  const auto& samples = config_.samples;
  expect(samples.size() >= 2, "replay.samples (their number)", static_cast<double>(samples.size()), "2 or more");
  const auto later = [&samples](std::size_t i) {
    // Unsigned, to avoid overflow.
    return static_cast<std::uint64_t>(samples[i].at.count()) - static_cast<std::uint64_t>(samples.front().at.count());
  };
  for (std::size_t i = 0; i < samples.size(); ++i) {
    expect_finite(samples[i].position, "replay.samples.position");
    expect(i == 0 || samples[i].at > samples[i - 1].at, "replay.samples.at", seconds(samples[i].at),
           "a time later than that of the previous sample");
    expect(static_cast<double>(later(i)) <= kLongest_s * 1e9, "replay.samples.at (since the first)",
           static_cast<double>(later(i)) / 1e9, "at most 1e9 s");
  }
  expect_not_negative(config_.position_resolution, "replay.position_resolution");
  const Duration span = samples.back().at - samples.front().at;
  round_ = span + span / static_cast<Duration::rep>(samples.size() - 1);
  info_ = {.name = "replay", .max_force = 0, .position_resolution = config_.position_resolution};
}

std::vector<ReplayDevice::Sample> ReplayDevice::samples_of(const ScriptedMotion::Recorded& motion) {
  expect_finite(motion.direction, "replay.direction");
  expect_above_zero(motion.direction.norm(), "replay.direction (its length)");
  const Vec3 direction = motion.direction.stableNormalized();
  std::vector<Sample> samples;
  samples.reserve(motion.samples.size());
  for (const auto& [t, x] : motion.samples) {
    const double since = t - motion.samples.front().t;
    expect(since <= kLongest_s, "replay.samples.t (since the first)", since, "at most 1e9 s");
    samples.push_back({Duration(std::llround(since * 1e9)), motion.origin + x * direction});
  }
  return samples;
}

std::uint64_t ReplayDevice::due_at(Duration since_start) const noexcept {
  const auto& samples = config_.samples;
  std::uint64_t rounds = 0;
  if (config_.at_end == AtEnd::kRepeat) {
    rounds = static_cast<std::uint64_t>(since_start / round_);
    since_start %= round_;
  }
  const auto after = std::ranges::upper_bound(samples, since_start, {},
                                              [&](const Sample& one) { return one.at - samples.front().at; });
  return rounds * samples.size() + static_cast<std::uint64_t>(after - samples.begin());
}

PositionSample ReplayDevice::sample(std::uint64_t number) const noexcept {
  const auto& samples = config_.samples;
  const Sample& one = samples[number % samples.size()];
  const auto rounds = static_cast<Duration::rep>(number / samples.size());
  return {.at = *start_ + rounds * round_ + (one.at - samples.front().at), .position = one.position};
}

std::optional<PositionSample> ReplayDevice::read(LocalTime now) noexcept {
  if (!start_) start_ = now;
  if (next_ < due_before_) next_ = due_before_ - 1;
  due_before_ = due_at(std::max(now - *start_, Duration::zero()));
  if (next_ < due_before_) return sample(next_++);
  if (config_.at_end == AtEnd::kHold && next_ == config_.samples.size()) {
    return PositionSample{.at = now, .position = config_.samples.back().position};
  }
  return std::nullopt;
}

Vec3 ReplayDevice::apply(const Vec3& /*force*/) noexcept { return Vec3::Zero(); }

const Driver& driver(const ReplayDevice::Config& /*config*/) {
  static const Driver kRow{.kind = "replay", .name = "recorded hand", .exerts_force = false};
  return kRow;
}

SimulatedDevice::Config stand_in(const ReplayDevice::Config& /*config*/) { return plain_stand_in("replay"); }

std::unique_ptr<Device> make(const ReplayDevice::Config& config, FromOutside /*outside*/) {
  return std::make_unique<ReplayDevice>(config);
}

}  // namespace tendon
