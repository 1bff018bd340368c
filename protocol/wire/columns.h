// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <bit>
#include <optional>
#include <span>

#include "protocol/messages.h"
#include "protocol/wire/fields/reader.h"
#include "protocol/wire/fields/writer.h"

// Encodes and decodes DeviceStates of several devices at the same step as columns. Does not use a list of fields, since
// a column contains values of several states, whose number the datagram limits. For codec.cc only. Realtime-safe.

namespace tendon::wire {

using States = std::span<const DeviceState* const>;

/// For lengths below 2¹⁴.
constexpr std::size_t size_of_length(std::size_t value) noexcept { return value < 0x80 ? 1 : 2; }
constexpr std::size_t size_of_varint(std::uint64_t value) noexcept {
  return (static_cast<std::size_t>(std::bit_width(value | 1U)) * 9 + 64) / 64;  // one byte for 7 bits
}
constexpr std::size_t size_of_field(std::size_t inside) noexcept { return 1 + size_of_length(inside) + inside; }

/// Calls visit(i, f) for each column of varints, where f(state) returns an entry. Their field numbers are consecutive.
constexpr unsigned kFirstCount = 9;
constexpr std::size_t kCounts = 6;
template <class Visit>
void for_each_count(Visit visit) noexcept {
  visit(std::size_t{0}, [](const DeviceState& state) { return static_cast<std::uint64_t>(state.mode); });
  visit(std::size_t{1}, [](const DeviceState& state) { return std::uint64_t{state.reasons}; });
  visit(std::size_t{2}, [](const DeviceState& state) { return state.force_sequence; });
  visit(std::size_t{3}, [](const DeviceState& state) { return static_cast<std::uint64_t>(state.force_age.count()); });
  visit(std::size_t{4}, [](const DeviceState& state) { return std::uint64_t{state.channel}; });
  visit(std::size_t{5}, [](const DeviceState& state) { return std::uint64_t{state.buttons}; });
}

struct ColumnSizes {
  /// Bytes of each column of varints, or 0 if it is omitted because all entries are 0.
  std::array<std::size_t, kCounts> counts;
  std::uint32_t devices = 0;
  std::size_t body = 0;

  explicit ColumnSizes(States states) noexcept {
    for (const DeviceState* state : states) devices |= 1U << state->device;
    body = 1 + size_of_varint(devices) + size_of_field(states.size() * 3 * sizeof(double)) +
           2 * size_of_field(states.size() * 3 * sizeof(float)) + 2 * size_of_field(states.size() * sizeof(float));
    if (states.front()->tick != 0) body += 1 + size_of_varint(states.front()->tick);
    if (states.front()->sampled != PeerTime{}) body += 1 + sizeof(std::int64_t);
    for_each_count([&](std::size_t column, auto value) TENDON_INLINE {
      std::uint64_t any = 0;
      std::size_t bytes = 0;
      for (const DeviceState* state : states) {
        any |= value(*state);
        bytes += size_of_varint(value(*state));
      }
      counts[column] = any != 0 || column == 0 ? bytes : 0;  // the modes are always sent
      body += counts[column] > 0 ? size_of_field(counts[column]) : 0;
    });
  }
  std::size_t whole() const noexcept { return size_of_field(size_of_field(body)); }  ///< of the frame
};

/// Writes a frame with as many of the first states as possible in `room` bytes. Returns the number of states.
inline std::size_t write_columns(Writer& to, std::size_t room, States states) noexcept {
  std::optional<ColumnSizes> sizes;
  for (; !states.empty(); states = states.first(states.size() - 1)) {
    sizes.emplace(states);
    if (sizes->whole() <= room) break;
  }
  if (states.empty()) return 0;
  Writer out = to;
  out.tag<3, kLength>();
  out.varint(size_of_field(sizes->body));
  out.tag<10, kLength>();
  out.varint(sizes->body);
  out.count(field<1>, "tick", states.front()->tick);
  out.time(field<2>, "sampled_ns", states.front()->sampled);
  out.count(field<3>, "devices", sizes->devices);
  out.column<4, double, 3>(states, [](const DeviceState& state, int i) { return state.position[i]; });
  out.column<5, float, 3>(states, [](const DeviceState& state, int i) { return state.velocity[i]; });
  out.column<6, float, 3>(states, [](const DeviceState& state, int i) { return state.force_applied[i]; });
  out.column<7, float, 1>(states, [](const DeviceState& state, int) { return state.energy; });
  out.column<8, float, 1>(states, [](const DeviceState& state, int) { return state.permitted_force; });
  for_each_count([&](std::size_t column, auto value) TENDON_INLINE {
    if (sizes->counts[column] == 0) return;
    out.varint((kFirstCount + column) << 3U | kLength);
    out.varint(sizes->counts[column]);
    for (const DeviceState* state : states) out.varint(value(*state));
  });
  to = out;
  return states.size();
}

/// next(tick) must return a new state for each call. If a state is refused, all of them must be dropped.
template <class Next>
void read_columns(Reader& in, Next next) {
  std::uint64_t tick = 0;
  PeerTime sampled{};
  std::uint32_t devices = 0;
  in.count(field<1>, "tick", tick);
  in.time(field<2>, "sampled_ns", sampled);
  in.count(field<3>, "devices", devices, Counts{1, (1U << limits::kMaxDevices) - 1});
  const auto count = static_cast<std::size_t>(std::popcount(devices & ((1U << limits::kMaxDevices) - 1)));
  constexpr std::size_t kMost = limits::kMaxDevices;
  std::array<double, 3 * kMost> position;
  std::array<float, 3 * kMost> velocity;
  std::array<float, 3 * kMost> force;
  std::array<float, kMost> energy;
  std::array<float, kMost> permitted;
  in.column(field<4>, "position_m", std::span(position).first(3 * count));
  in.column(field<5>, "velocity_mps", std::span(velocity).first(3 * count));
  in.column(field<6>, "force_applied_n", std::span(force).first(3 * count));
  in.column(field<7>, "energy_j", std::span(energy).first(count));
  in.column(field<8>, "permitted_force_n", std::span(permitted).first(count));
  std::array<std::array<std::uint64_t, kMost>, kCounts> counts{};
  auto& [mode, reasons, sequence, age, channel, buttons] = counts;
  constexpr std::uint64_t kMost32 = std::numeric_limits<std::uint32_t>::max();
  constexpr std::uint64_t kMost64 = std::numeric_limits<std::uint64_t>::max();
  in.column(field<9>, "mode", std::span(mode).first(count), kMost32);
  in.column(field<10>, "reasons", std::span(reasons).first(count), kMost32);
  in.column(field<11>, "force_sequence", std::span(sequence).first(count), kMost64);
  in.column(field<12>, "force_age_ns", std::span(age).first(count), kMost64);
  in.column(field<13>, "channel", std::span(channel).first(count), kMost32);
  in.column(field<14>, "buttons", std::span(buttons).first(count), kMost32);
  if (!in.done() || in.refused() != nullptr) return;
  for (std::size_t i = 0; i < count; ++i, devices &= devices - 1) {
    DeviceState& state = next(tick);
    const auto vector = [&](const auto& column) { return Vec3(column[3 * i], column[3 * i + 1], column[3 * i + 2]); };
    state.sampled = sampled;
    state.position = vector(position);
    state.velocity = vector(velocity);
    state.force_applied = vector(force);
    state.energy = energy[i];
    state.permitted_force = permitted[i];
    state.reasons = static_cast<std::uint32_t>(reasons[i]);
    state.force_sequence = sequence[i];
    state.force_age = Duration(static_cast<std::int64_t>(age[i]));
    state.mode = static_cast<Mode>(mode[i]);
    state.device = static_cast<std::uint32_t>(std::countr_zero(devices));
    state.channel = static_cast<std::uint32_t>(channel[i]);
    state.buttons = static_cast<std::uint32_t>(buttons[i]);
    const auto all_bounded = [](const Vec3& v) { return (v.array().abs() <= limits::kMaxValue).all(); };
    in.require("position_m", all_bounded(state.position));
    in.require("velocity_mps", all_bounded(state.velocity));
    in.require("force_applied_n", all_bounded(state.force_applied));
    in.require("energy_j", Within{}.holds(state.energy));
    in.require("permitted_force_n", Within{.least = 0, .infinity = true}.holds(state.permitted_force));
    in.require("mode", mode[i] >= 1 && mode[i] <= static_cast<std::uint64_t>(Mode::kFault));
    in.require("force_age_ns", age[i] <= static_cast<std::uint64_t>(limits::kMaxTime.count()));
    in.require("channel", channel[i] < limits::kMaxChannels);
    if (in.refused() != nullptr) return;
  }
}

}  // namespace tendon::wire
