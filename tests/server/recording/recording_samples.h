// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "server/recording/byte_sink.h"
#include "server/recording/recorder.h"
#include "server/recording/recording_reader.h"

namespace tendon::testing {

inline LocalTime ms(std::int64_t t) { return LocalTime(std::chrono::milliseconds(t)); }

inline Recorder::Config sample_config() {
  Recorder::Config config;
  config.scene = {.text = "[device]\nprofile = \"touch\"  # µm\n",
                  .seed = 42,
                  .version = "0.1.0",
                  .commit = "0123abc",
                  .unix_offset = Duration(0)};
  return config;
}

/// Returns step `tick` of a hand that oscillates at 1 Hz. There is one step per ms, and no field has its default value.
inline StepRecord sample_step(std::uint64_t tick) {
  const auto t = static_cast<double>(tick) * 1e-3;
  const LocalTime due = ms(static_cast<std::int64_t>(tick));
  StepRecord step;
  step.tick = tick;
  step.scheduled = due;
  step.hand = {.at = due + std::chrono::microseconds(17),
               .position = Vec3(0.05 * std::sin(6.28 * t), 0.01, -0.0),
               .velocity = Vec3(0.314 * std::cos(6.28 * t), 0, 1e-9)};
  step.held = std::chrono::microseconds(1003);
  step.was_applied = Vec3(-1.5, 0.25, 0);
  step.wanted = Vec3(-3, 0, 4);
  step.permitted = tick == 0 ? INFINITY : 2.5;
  step.force = Vec3(-1.5, 0, 2);
  step.applied = Vec3(-1.2, 0, 1.6);
  step.energy = 1e-4 * t + 0.25;
  step.reasons = Reason::kEnergy;
  if (tick % 2 == 1) step.reasons |= Reason::kSlew;
  step.mode = Mode::kActive;
  step.force_sequence = tick / 10 + 1;
  step.channel = static_cast<std::uint32_t>(tick % 3);
  step.force_age = std::chrono::milliseconds(3);
  step.loop_age = std::chrono::milliseconds(43);
  if (tick % 2 == 0) step.force_error = 0.125;
  step.rearmed = tick % 5 == 0;
  step.disarmed = tick % 7 == 0;
  step.buttons = static_cast<std::uint32_t>(tick % 5);
  if (tick % 3 != 0) step.handle.emplace();
  if (tick % 3 == 1) {
    step.handle->turn = TurnStep{.hand = {.orientation = {0.5, -0.5, 0.5, t}, .angular_velocity = {1, -2, t}},
                                 .was_applied = {0.1, 0, -t},
                                 .wanted = {0.2, 0.3, 0.4},
                                 .torque = {0.05, 0.06, 0.07},
                                 .applied = {0.01, 0.02, 0.03}};
  }
  if (tick % 6 == 2 || tick % 6 == 1) {
    step.handle->grip = GripStep{.hand = {.opening = 0.3 + t, .velocity = -1.5},
                                 .was_applied = 0.75,
                                 .wanted = 2,
                                 .force = 1.5,
                                 .applied = 1.25,
                                 .permitted = 1.5,
                                 .energy = 1e-3};
  }
  if (tick % 4 == 3) {
    if (!step.handle) step.handle.emplace();
    step.handle->joints = Joints::three({0.1, t, -0.3}, {t, -2, 3});
  }
  if (step.handle && !step.handle->turn && !step.handle->grip && !step.handle->joints) step.handle.reset();
  if (tick % 3 == 2) {
    step.field = FieldStep{.generation = 7,
                           .channel = 2,
                           .swapping = true,
                           .depth = 1e-3,
                           .proxy = {0.01, t, -0.02},
                           .force = {-1, 0.5, t},
                           .stored = 0.125 + t,
                           .refused = 1e-5,
                           .credit = 1e-4};
  }
  step.longest_hold = std::chrono::microseconds(2000 + tick);
  if (tick % 11 == 0) step.reasons |= Reason::kAcceleration;
  if (tick % 4 < 2) step.stiffness << 500, -1, 2, -1, 600, 3, 2, 3.5, 700 + t;
  return step;
}

inline DatagramRecord sample_datagram(LocalTime at, std::uint32_t size, bool in) {
  DatagramRecord datagram;
  datagram.at = at;
  datagram.direction = in ? DatagramRecord::Direction::kIn : DatagramRecord::Direction::kOut;
  datagram.peer.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 127, 0, 0, 1};
  datagram.peer.port = 47110;
  datagram.size = size;
  datagram.bytes.fill(std::byte{0});
  for (std::size_t i = 0; i < std::min<std::size_t>(size, kMaxDatagram); ++i)
    datagram.bytes[i] = static_cast<std::byte>(i * 7 + 1);
  return datagram;
}

/// Records `steps` steps. Every tenth step has one datagram in each direction.
inline void record_samples(Recorder& recorder, std::uint64_t steps) {
  for (std::uint64_t tick = 0; tick < steps; ++tick) {
    recorder.record(sample_step(tick));
    if (tick % 10 == 9) {
      recorder.record(sample_datagram(ms(static_cast<std::int64_t>(tick)), 120, false));
      recorder.record(sample_datagram(ms(static_cast<std::int64_t>(tick)) - std::chrono::microseconds(300), 90, true));
    }
  }
}

inline bool same(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }
inline bool same(const Vec3& a, const Vec3& b) {
  return same(a.x(), b.x()) && same(a.y(), b.y()) && same(a.z(), b.z());
}
inline bool same(const std::optional<HandleStep>& a, const std::optional<HandleStep>& b) {
  if (a.has_value() != b.has_value()) return false;
  if (!a) return true;
  if (a->turn.has_value() != b->turn.has_value() || a->grip.has_value() != b->grip.has_value()) return false;
  const auto same_turn = [](const TurnStep& x, const TurnStep& y) {
    return x.hand == y.hand && same(x.was_applied, y.was_applied) && same(x.wanted, y.wanted) &&
           same(x.torque, y.torque) && same(x.applied, y.applied);
  };
  const auto same_grip = [](const GripStep& x, const GripStep& y) {
    return x.hand == y.hand && same(x.was_applied, y.was_applied) && same(x.wanted, y.wanted) &&
           same(x.force, y.force) && same(x.applied, y.applied) && same(x.permitted, y.permitted) &&
           same(x.energy, y.energy);
  };
  return a->joints == b->joints && (!a->turn || same_turn(*a->turn, *b->turn)) &&
         (!a->grip || same_grip(*a->grip, *b->grip));
}
inline bool same(const std::optional<FieldStep>& a, const std::optional<FieldStep>& b) {
  if (a.has_value() != b.has_value()) return false;
  return !a || (a->generation == b->generation && a->channel == b->channel && a->swapping == b->swapping &&
                same(a->depth, b->depth) && same(a->proxy, b->proxy) && same(a->force, b->force) &&
                same(a->stored, b->stored) && same(a->refused, b->refused) && same(a->credit, b->credit));
}
inline bool same(const StepRecord& a, const StepRecord& b) {
  return a.tick == b.tick && a.scheduled == b.scheduled && a.hand.at == b.hand.at &&
         same(a.hand.position, b.hand.position) && same(a.hand.velocity, b.hand.velocity) && a.held == b.held &&
         same(a.was_applied, b.was_applied) && same(a.wanted, b.wanted) && same(a.permitted, b.permitted) &&
         same(a.force, b.force) && same(a.applied, b.applied) && same(a.energy, b.energy) && a.reasons == b.reasons &&
         a.mode == b.mode && a.rearmed == b.rearmed && a.disarmed == b.disarmed && a.buttons == b.buttons &&
         a.longest_hold == b.longest_hold && same(a.handle, b.handle) && same(a.field, b.field) &&
         a.force_sequence == b.force_sequence && a.force_age == b.force_age && a.loop_age == b.loop_age &&
         a.channel == b.channel && a.force_error.has_value() == b.force_error.has_value() &&
         same(a.force_error.value_or(0), b.force_error.value_or(0)) && a.force_way == b.force_way &&
         std::equal(a.stiffness.reshaped().begin(), a.stiffness.reshaped().end(), b.stiffness.reshaped().begin());
}
inline bool same(const DatagramRecord& a, const DatagramRecord& b) {
  const auto kept = [](const DatagramRecord& r) {
    return std::span(r.bytes).first(std::min<std::size_t>(r.size, r.bytes.size()));
  };
  return a.at == b.at && a.direction == b.direction && a.peer == b.peer && a.size == b.size &&
         std::ranges::equal(kept(a), kept(b));
}

struct Contents {
  std::vector<SceneRecord> scenes;
  std::vector<StepRecord> steps;
  std::vector<DatagramRecord> datagrams;
  std::vector<LossRecord> losses;
  bool truncated = false;
  std::vector<std::string> damage;
  std::string error;  ///< the exception that the reader throws

  std::size_t records() const { return scenes.size() + steps.size() + datagrams.size() + losses.size(); }
};

inline std::unique_ptr<std::istream> stream(std::span<const std::byte> bytes) {
  return std::make_unique<std::istringstream>(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

inline Contents read_all(RecordingReader& reader) {
  Contents contents;
  try {
    while (auto record = reader.next()) {
      if (auto* scene = std::get_if<SceneRecord>(&*record)) contents.scenes.push_back(std::move(*scene));
      if (auto* step = std::get_if<StepRecord>(&*record)) contents.steps.push_back(*step);
      if (auto* datagram = std::get_if<DatagramRecord>(&*record)) contents.datagrams.push_back(*datagram);
      if (auto* loss = std::get_if<LossRecord>(&*record)) contents.losses.push_back(*loss);
    }
  } catch (const std::runtime_error& error) {
    contents.error = error.what();
  }
  contents.truncated = reader.truncated();
  contents.damage = reader.damage();
  return contents;
}

inline Contents read_all(std::span<const std::byte> bytes) {
  try {
    RecordingReader reader(stream(bytes), "a.mcap");
    return read_all(reader);
  } catch (const std::runtime_error& error) {
    Contents contents;
    contents.error = error.what();
    return contents;
  }
}

}  // namespace tendon::testing
