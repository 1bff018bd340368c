// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/woodenhaptics/fake_woodenhaptics.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace tendon {
namespace {

using namespace std::chrono_literals;

constexpr Duration kFrame = 1ms;
constexpr Duration kWatchdog = 500ms;
constexpr std::size_t kReport = 14;

}  // namespace

FakeWoodenHaptics::FakeWoodenHaptics(const Options& options) : options_(options), arm_(options.model) {
  move_to(Vec3::Zero());
  reset();
}

int FakeWoodenHaptics::counts(std::size_t motor) const {
  const auto i = static_cast<Eigen::Index>(motor);
  return static_cast<int>(std::lround(angles_[i] / arm_.per_count()[i]));
}

void FakeWoodenHaptics::reset() {
  for (std::size_t i = 0; i < 3; ++i) origin_[i] = -counts(i);  // the counters start at 0, because there is no index
  begun_ = calibrate_ = calibrated_ = amplifiers_on_ = false;
  current_ma_ = {};
  told_.reset();
  in_buffer_.reset();
  out_buffer_.reset();
  boots_.reset();
}

void FakeWoodenHaptics::plug() {
  plugged_ = true;
  ++times_plugged_;
}

void FakeWoodenHaptics::unplug() {
  plugged_ = false;
  cancel();
  if (!options_.own_supply) reset();
}

void FakeWoodenHaptics::cancel() {
  from_host_.clear();
  to_host_.clear();
}

void FakeWoodenHaptics::set_fault(Fault fault) {
  if (fault == Fault::kForgets) {
    reset();
    boots_ = LocalTime::min();
  }
  if (fault == Fault::kCalibrates) calibrate_ = true;
  fault_ = fault;
}

bool FakeWoodenHaptics::write(LocalTime now, std::span<const std::uint8_t> bytes) {
  advance(now);
  if (fault_ == Fault::kStalls) return false;
  from_host_.emplace_back(bytes.begin(), bytes.end());
  most_waiting_ = std::max(most_waiting_, static_cast<int>(from_host_.size()));
  return true;
}

LocalTime FakeWoodenHaptics::next_in() const {
  if (!to_host_.empty()) return to_host_.front().first;
  const bool busy = in_buffer_ || out_buffer_ || !from_host_.empty() || !boots_;
  return busy && next_frame_ ? *next_frame_ : LocalTime::max();
}

std::vector<std::uint8_t> FakeWoodenHaptics::take_in(LocalTime now) {
  advance(now);
  if (to_host_.empty()) return {};
  auto bytes = std::move(to_host_.front().second);
  to_host_.pop_front();
  return bytes;
}

void FakeWoodenHaptics::advance(LocalTime now) {
  if (!next_frame_) next_frame_ = now;
  for (; *next_frame_ <= now; *next_frame_ += kFrame) frame(*next_frame_);
}

void FakeWoodenHaptics::frame(LocalTime at) {
  if (told_ && at - *told_ >= kWatchdog) {
    told_.reset();
    amplifiers_on_ = false;
    current_ma_ = {};
  }
  if (!boots_) boots_ = at + options_.boot;
  if (plugged_ && in_buffer_) {
    if (!in_buffer_->empty()) to_host_.emplace_back(at, std::move(*in_buffer_));
    in_buffer_.reset();
  }
  if (plugged_ && !out_buffer_ && !from_host_.empty()) {
    out_buffer_ = std::move(from_host_.front());
    from_host_.pop_front();
  }
  if (at >= *boots_ && fault_ != Fault::kHangs) run(at);
}

// Runs one iteration of the firmware loop per frame. It sends a report, and then waits for the next one.
void FakeWoodenHaptics::run(LocalTime at) {
  if (in_buffer_) return;
  if (begun_) {
    if (!out_buffer_) return;
    obey(at, *std::exchange(out_buffer_, std::nullopt));
  }
  begun_ = true;
  say(at);
}

void FakeWoodenHaptics::obey(LocalTime at, const std::vector<std::uint8_t>& bytes) {
  if (bytes.size() != kReport) return;
  const auto field = [&bytes](std::size_t i) {
    const int value = bytes[2 * i] + 256 * bytes[2 * i + 1];
    return value >= 32768 ? value - 65536 : value;
  };
  ++obeyed_;
  told_ = at;
  amplifiers_on_ = true;
  if (field(3) == 1) {
    ++calibrations_;
    for (std::size_t i = 0; i < 3; ++i) origin_[i] = field(4 + i) - counts(i);
    calibrate_ = false;
    calibrated_ = true;
    current_ma_ = {};
  } else {
    current_ma_ = {field(0), field(1), field(2)};
  }
}

void FakeWoodenHaptics::say(LocalTime at) {
  ++said_;
  std::vector<std::uint8_t> bytes;
  const auto put = [&bytes](int value) {
    bytes.push_back(static_cast<std::uint8_t>(value & 255));
    bytes.push_back(static_cast<std::uint8_t>((value >> 8) & 255));
  };
  for (std::size_t i = 0; i < 3; ++i) put(origin_[i] + counts(i) + (fault_ == Fault::kJumps && i == 1 ? 900 : 0));
  put(switch_closed_ ? 10'000 : 0);
  put(0);
  put(0);
  put(fault_ == Fault::kGarblesAll ? 7 : calibrate_ ? 1 : 0);

  const bool third = said_ % 3 == 0;
  in_buffer_.emplace();  // a report of size 0 is not sent
  if (fault_ == Fault::kSilent || (fault_ == Fault::kDropsSome && third)) return;
  if (fault_ == Fault::kBabbles || fault_ == Fault::kBabblesOnly) {
    std::vector<std::uint8_t> noise(1 + dice_.bits() % 64);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(dice_.bits());
    if (noise.size() == kReport) noise.pop_back();  // otherwise it might be a valid report
    if (plugged_) to_host_.emplace_back(at + kFrame, noise);
    if (fault_ == Fault::kBabblesOnly) return;
  }
  if (fault_ == Fault::kGarblesSome && third)
    bytes[dice_.bits() % kReport] ^= static_cast<std::uint8_t>(1 + dice_.bits() % 255);
  if (fault_ == Fault::kCutsAll) bytes.pop_back();
  if (fault_ == Fault::kPadsAll) bytes.resize(64);
  in_buffer_ = std::move(bytes);
}

double FakeWoodenHaptics::pulse_width(std::size_t motor) const {
  return 0.4 * (current_ma_[motor] * 1e-3) / arm_.full_scale() + 0.5;
}

Vec3 FakeWoodenHaptics::force() const {
  if (!amplifiers_on_) return Vec3::Zero();
  const Vec3 amperes = 1e-3 * Vec3(current_ma_[0], current_ma_[1], current_ma_[2]);
  const Vec3 torque = amperes.cwiseProduct(arm_.per_ampere());
  return arm_.numeric_jacobian(angles_).transpose().partialPivLu().solve(torque);
}

}  // namespace tendon
