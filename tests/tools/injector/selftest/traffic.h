// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/selftest/selftest.h"

namespace tendon::injector {

inline constexpr double kMs = 1e6;                                 // ns
inline constexpr Duration kPeriod = std::chrono::milliseconds(1);  // default interval of datagrams

inline double ns(Duration d) { return static_cast<double>(d.count()); }

struct Traffic {
  Duration period = kPeriod;
  std::uint32_t size = 200;
  std::uint32_t link = 0;
  Direction direction = Direction::kUp;
  /// Arrival of datagram i after the start, for irregular intervals.
  std::function<Duration(std::size_t)> at = {};
  /// The first byte of datagram i; rules select datagrams by this byte.
  std::function<std::uint8_t(std::size_t)> type = {};
};

/// Not zero, to detect an injector that mistakes absolute times for times since its start.
inline constexpr LocalTime kStart{std::chrono::hours(1)};

template <class Visit>
void play(const Profile& profile, const Traffic& traffic, const SelftestOptions& options, Visit visit) {
  Injector injector(profile, options.seed, traffic.link, traffic.direction);
  std::vector<std::byte> payload(traffic.size);
  for (std::size_t i = 0; i < options.count; ++i) {
    const Duration after = traffic.at ? traffic.at(i) : traffic.period * static_cast<std::int64_t>(i);
    if (traffic.type) payload[0] = std::byte{traffic.type(i)};
    visit(i, injector.decide({.arrival = kStart + after, .size = traffic.size, .bytes = payload}));
  }
}

inline bool lost(const Decision& decision) { return decision.verdict == Verdict::kDrop; }

inline Duration delay(const Decision& decision) { return decision.release - decision.arrival; }

std::vector<double> delays(const Profile& profile, const Traffic& traffic, const SelftestOptions& options);

}  // namespace tendon::injector
