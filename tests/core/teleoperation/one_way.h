// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <vector>

#include "tests/support/dice.h"

namespace tendon {

/// Impairments of one network direction, in periods of the loop.
struct Network {
  int delay = 0;
  int jitter = 0;   ///< 0 … jitter is added to each message independently, so messages overtake each other
  double loss = 0;  ///< probability
  std::uint64_t seed = 1;
  double repeated = 0;  ///< probability of a duplicate, up to 1000 periods later
  /// The delay is increased by `longer_by` from period `longer_from` on.
  int longer_from = std::numeric_limits<int>::max();
  int longer_by = 0;
  /// Messages of `burst_from` to `burst_until` wait for the end of their burst of `burst` periods.
  int burst = 1;
  int burst_from = 0;
  int burst_until = std::numeric_limits<int>::max();
  /// Messages sent in [cut_from, cut_until) are lost.
  int cut_from = std::numeric_limits<int>::max();
  int cut_until = 0;
  /// Periods in which copies of a message of period `now` arrive. Replaces all other fields.
  std::function<std::vector<int>(int now)> arrivals{};
};

/// Returns a random network. It stalls for 10 to 600 periods, and then all messages arrive at once. It also has a delay,
/// reordering, loss, and duplicates that are up to 1000 periods late.
inline Network rough_network(Dice& dice) {
  struct State {
    Dice dice;
    int delay, jitter;
    double loss, repeated, stalls;
    int until = 0;
  };
  State drawn{.dice = Dice(dice.bits()),
              .delay = dice.chance(0.3) ? 0 : static_cast<int>(dice.decades(0, 2)),
              .jitter = static_cast<int>(dice.decades(0, 1.7)),
              .loss = dice.chance(0.5) ? 0 : dice.uniform() * 0.3,
              .repeated = dice.uniform() * 0.5,
              .stalls = dice.decades(-3, -1.3)};
  return {.arrivals = [of = drawn](int now) mutable {
    if (now >= of.until && of.dice.chance(of.stalls)) of.until = now + static_cast<int>(of.dice.decades(1, 2.8));
    if (of.dice.chance(of.loss)) return std::vector<int>{};
    const int sent = std::max(now, of.until) + of.delay;
    std::vector<int> arrivals{sent + (now < of.until ? 0 : static_cast<int>(of.dice.within(0, of.jitter + 1)))};
    if (of.dice.chance(of.repeated)) arrivals.push_back(sent + static_cast<int>(of.dice.decades(0, 3)));
    return arrivals;
  }};
}

/// One direction of a bad network. The time is the number of the period, which both ends share.
template <class Message>
class OneWay {
 public:
  explicit OneWay(const Network& network) : network_(network), dice_(network.seed) {}

  void send(int now, const Message& message) {
    if (network_.arrivals) {
      for (const int at : network_.arrivals(now)) under_way_.emplace(at, Parcel{sent_++, message});
      return;
    }
    const bool lost = dice_.chance(network_.loss);
    const int extra = static_cast<int>(dice_.within(0, network_.jitter + 1));
    if (lost || (now >= network_.cut_from && now < network_.cut_until)) return;
    const bool waits = now >= network_.burst_from && now < network_.burst_until;
    const int wait = waits ? network_.burst - 1 - now % network_.burst : 0;
    const int at = now + wait + network_.delay + extra + (now >= network_.longer_from ? network_.longer_by : 0);
    under_way_.emplace(at, Parcel{sent_++, message});
    if (network_.repeated > 0 && dice_.chance(network_.repeated)) {
      under_way_.emplace(at + static_cast<int>(dice_.within(0, 1000)), Parcel{sent_++, message});
    }
  }

  template <class Receive>
  void deliver(int now, Receive receive) {
    const auto last = under_way_.upper_bound(now);
    std::vector<const Parcel*> arrived;
    for (auto parcel = under_way_.begin(); parcel != last; ++parcel) arrived.push_back(&parcel->second);
    std::ranges::sort(arrived, {}, &Parcel::number);
    for (const Parcel* const parcel : arrived) receive(parcel->message);
    under_way_.erase(under_way_.begin(), last);
  }

 private:
  struct Parcel {
    std::uint64_t number;
    Message message;
  };
  Network network_;
  Dice dice_;
  std::multimap<int, Parcel> under_way_;  ///< keyed by arrival period
  std::uint64_t sent_ = 0;
};

}  // namespace tendon
