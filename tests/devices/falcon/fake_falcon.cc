// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/falcon/fake_falcon.h"

#include <algorithm>
#include <cmath>

#include "tests/devices/falcon/published_geometry.h"

namespace tendon {
namespace {

constexpr std::array<std::uint8_t, 3> kGreeting = {0x0A, 0x43, 0x0D};
constexpr std::size_t kPayload = 62;
/// Encoder counts before homing.
constexpr std::array<int, 3> kNoOrigin = {711, -402, 95};

/// The descriptors of an FT232R with the IDs of the Falcon: two bulk endpoints of 64 bytes, no strings.
constexpr std::array<std::uint8_t, 50> kDescriptors = {18,   1,    0,    2, 0,  0,   0,   64,   0x03,
                                                       0x04, 0x48, 0xCB, 0, 4,  0,   0,   0,    1,     //
                                                       9,    2,    32,   0, 1,  1,   0,   0xC0, 0xFA,  //
                                                       9,    4,    0,    0, 2,  255, 255, 255,  0,     //
                                                       7,    5,    0x81, 2, 64, 0,   0,                //
                                                       7,    5,    0x02, 2, 64, 0,   0};

}  // namespace

FakeFalcon::FakeFalcon(const Options& options)
    : options_(options), mode_(options.has_firmware ? Mode::kRunning : Mode::kGreeting) {
  homed_ = options.is_homed ? 7 : 0;
  origin_ = options.is_homed ? std::array<int, 3>{} : kNoOrigin;
}

std::span<const std::uint8_t> FakeFalcon::descriptors() const { return kDescriptors; }

void FakeFalcon::reset() {
  mode_ = Mode::kGreeting;
  heard_.clear();
  image_.clear();
  torque_ = {};
  homed_ = 0;
  homing_ = false;
  origin_ = kNoOrigin;
}

void FakeFalcon::unplug() {
  plugged_ = false;
  rx_.clear();
  latency_ms_ = 16;
  divisor_ = 0x4138;
  flush_at_ = 0;
  dtr_ = false;
  if (!options_.own_supply) reset();
}

void FakeFalcon::pull_through() {
  if (!homing_ || mode_ != Mode::kRunning) return;
  homed_ = 7;
  origin_ = {};
}

void FakeFalcon::set_fault(Fault fault) {
  if (fault == Fault::kLosesFirmware) reset();
  if (fault == Fault::kLosesHome) homed_ &= 5;
  fault_ = fault;
}

bool FakeFalcon::request(LocalTime now, std::uint8_t request, std::uint16_t value) {
  if (fault_ == Fault::kStalls) return false;
  switch (request) {
    case 0:
      rx_.clear();
      break;
    case 1:
      if ((value & 0x0100) != 0) {
        const bool rises = !dtr_ && (value & 1) != 0;
        dtr_ = (value & 1) != 0;
        if (rises) reset();
      }
      break;
    case 3:
      divisor_ = value;
      break;
    case 6:
      if (options_.knows_flush_character) flush_at_ = (value & 0x100) != 0 ? static_cast<std::uint8_t>(value) : 0;
      break;
    case 9:
      latency_ms_ = value;
      last_in_ = now;
      break;
    default:
      break;
  }
  return true;
}

Duration FakeFalcon::per_byte() const {
  const double divisor = (divisor_ & 0x3FFF) + (divisor_ >> 14 == 1 ? 0.5 : 0);
  return from_seconds(10 * divisor / 3e6);
}

bool FakeFalcon::write(LocalTime now, std::span<const std::uint8_t> bytes) {
  if (fault_ == Fault::kStalls) return false;
  tx_free_ = std::max(tx_free_, now);
  for (const std::uint8_t byte : bytes) {
    tx_free_ += per_byte();
    hear(tx_free_, byte);
  }
  return true;
}

void FakeFalcon::hear(LocalTime at, std::uint8_t byte) {
  const auto speed = mode_ == Mode::kGreeting ? 0x4138 : mode_ == Mode::kRunning ? 2 : 0x15;
  if (divisor_ != speed) {
    heard_garbage_ = true;
    return;
  }
  heard_.push_back(byte);
  switch (mode_) {
    case Mode::kGreeting:
      if (heard_.size() >= 3 && std::equal(kGreeting.begin(), kGreeting.end(), heard_.end() - 3)) {
        heard_.clear();
        mode_ = Mode::kGreeted;
        constexpr std::array<std::uint8_t, 5> kAnswer = {0x00, 0x0A, 0x44, 0x2C, 0x0D};
        say(at, std::span(kAnswer).subspan(options_.answers_greeting_late ? 0 : 1));
      }
      break;
    case Mode::kGreeted:
      say(at, std::array{byte});
      if (byte == 'A' && !dtr_) mode_ = Mode::kLoading;
      heard_.clear();
      break;
    case Mode::kLoading:
      image_.push_back(byte);
      heard_.clear();
      say(at, std::array{byte});
      if (image_.size() == options_.firmware_bytes && image_[0] == 0xAA && image_[1] == 0x08) mode_ = Mode::kRunning;
      break;
    case Mode::kRunning:
      if (heard_.front() != '<') heard_.clear();
      if (heard_.size() == 16) {
        if (heard_.back() == '>') obey(at);
        heard_.clear();
      }
      break;
  }
}

void FakeFalcon::obey(LocalTime at) {
  ++commands_;
  for (std::size_t leg = 0; leg < 3; ++leg) {
    int count = 0;
    for (std::size_t i = 4; i-- > 0;) count = count * 16 + (heard_[1 + 4 * leg + i] - 'A');
    torque_[leg] = static_cast<std::int16_t>(count >= 32768 ? count - 65536 : count);
  }
  const int flags = heard_[13] - 'A';
  homing_ = (flags & 1) != 0;
  if (!homing_) homed_ = 0;
  lamps_ = static_cast<std::uint8_t>(flags & 14);
  reply(at + options_.thinking);
}

void FakeFalcon::reply(LocalTime at) {
  ++replies_;
  std::array<std::uint8_t, 16> bytes{};
  bytes.fill('A');
  bytes.front() = '<';
  bytes.back() = '>';
  const Vec3 angles = published::angles_at(position_);
  for (std::size_t leg = 0; leg < 3; ++leg) {
    const double counts = (angles[static_cast<Eigen::Index>(leg)] - published::kAtZero) / published::kPerCount;
    int count = static_cast<int>(std::lround(counts)) + origin_[leg];
    if (fault_ == Fault::kJumps && leg == 1) count += 400;
    if (fault_ == Fault::kOutOfReach) count = leg == 0 ? -20000 : 20000;
    for (std::size_t i = 0; i < 4; ++i)
      bytes[1 + 4 * leg + i] = static_cast<std::uint8_t>('A' + ((count >> (4 * i)) & 15));
  }
  bytes[13] = static_cast<std::uint8_t>('A' + buttons_ + 16 * homed_);

  const bool third = replies_ % 3 == 0;
  if (fault_ == Fault::kSilent || (fault_ == Fault::kDropsSome && third)) return;
  if (fault_ == Fault::kGarblesSome && third)
    bytes[dice_.bits() % 16] ^= static_cast<std::uint8_t>(1 + dice_.bits() % 255);
  if (fault_ == Fault::kGarblesAll) bytes[1 + dice_.bits() % 12] = 'Q';
  if (fault_ == Fault::kBabbles || fault_ == Fault::kBabblesOnly) {
    std::array<std::uint8_t, 40> noise{};
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(dice_.bits());
    say(at, std::span(noise).first(dice_.bits() % noise.size()));
    if (fault_ == Fault::kBabblesOnly) return;
  }
  if (fault_ == Fault::kSplits) split_left_ = 1 + dice_.bits() % 15;
  say(at, std::span(bytes).first(fault_ == Fault::kCutsAll ? 13 : 16));
}

void FakeFalcon::say(LocalTime at, std::span<const std::uint8_t> bytes) {
  if (fault_ == Fault::kSilent) return;
  rx_free_ = std::max(rx_free_, at);
  for (const std::uint8_t byte : bytes) {
    rx_free_ += per_byte();
    const bool garbled = fault_ == Fault::kGarblesAll && mode_ != Mode::kRunning;
    rx_.emplace_back(rx_free_, garbled ? byte ^ 0x40 : byte);
  }
}

LocalTime FakeFalcon::next_in() const {
  LocalTime due = last_in_ + std::chrono::milliseconds(std::max(1, latency_ms_));
  if (rx_.size() >= kPayload) due = std::min(due, rx_[kPayload - 1].first);
  if (flush_at_ != 0) {
    const auto flush = std::ranges::find(rx_, flush_at_, [](const auto& byte) { return byte.second; });
    if (flush != rx_.end()) due = std::min(due, flush->first);
  }
  return due;
}

std::vector<std::uint8_t> FakeFalcon::take_in(LocalTime now) {
  std::vector<std::uint8_t> packet = {0x01, 0x60};
  const std::size_t most = split_left_ > 0 && !rx_.empty() ? std::exchange(split_left_, 0) : kPayload;
  while (packet.size() < 2 + most && !rx_.empty() && rx_.front().first <= now) {
    packet.push_back(rx_.front().second);
    rx_.pop_front();
  }
  last_in_ = now;
  return packet;
}

Vec3 FakeFalcon::force() const {
  const Vec3 torque = Vec3(torque_[0], torque_[1], torque_[2]) * -1e-4;
  return published::numeric_jacobian(published::angles_at, position_).transpose() * torque;
}

}  // namespace tendon
