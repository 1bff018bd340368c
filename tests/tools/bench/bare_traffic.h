// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/time.h"
#include "tests/tools/injector/proxy/duration_histogram.h"

namespace tendon::bench {

/// The baseline of a fleet. It sends the same number of datagrams with the same sizes but without content, in both
/// directions, between one socket and another process that has one socket for each session.
struct BareTraffic {
  std::size_t sessions = 0;
  Duration period = std::chrono::milliseconds(1);
  std::size_t out_per_round = 1;  ///< datagrams to each session per period
  std::size_t out_bytes = 0;
  std::size_t in_per_round = 1;
  std::size_t in_bytes = 0;
  Duration length = std::chrono::seconds(1);
  int priority = 0;
};
struct BareResult {
  double seconds = 0;
  std::uint64_t rounds = 0;
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  injector::DurationHistogram age;  ///< kernel receive time − start of the round
  Duration host{};                  ///< processor time
  Duration guests{};
};
BareResult run_bare(const BareTraffic& traffic);

}  // namespace tendon::bench
