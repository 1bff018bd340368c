// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/time.h"

namespace tendon::injector {

/// What one direction of a bad network does to datagrams.
struct Profile {
  Duration delay{};      ///< constant part of the one-way delay
  Duration jitter{};     ///< uniform in ±jitter is added to `delay`; delays below zero become zero
  double loss = 0;       ///< probability that a datagram vanishes, 0…1
  double duplicate = 0;  ///< probability that a datagram arrives twice, 0…1

  /// One-way delays from `lower` up to the next bin's `lower`. The last bin is as wide as the one
  /// before it; a histogram of one bin is one constant delay.
  struct Bin {
    Duration lower{};
    double weight = 0;  ///< share or count: only the ratio to the sum of all weights matters
    bool operator==(const Bin&) const = default;
  };
  /// When not empty: one-way delays are drawn from this histogram (within a bin the delay is
  /// uniform) and `delay` is added to them. It replaces `jitter`, which must then be zero.
  std::vector<Bin> histogram;

  bool operator==(const Profile&) const = default;
};

/// Nobody feels a force that is later than this, and it bounds what a proxy has to keep in memory.
inline constexpr Duration kMaxDelay = std::chrono::seconds(60);

/// Measured histograms have about 100 bins; a million lines are a list of samples, not a histogram.
inline constexpr std::size_t kMaxBins = 10'000;

/// Throws std::invalid_argument naming field, value and what was expected, when `profile` is
/// impossible: "loss is 150%, expected a probability from 0% to 100%".
void check(const Profile& profile);

/// The profile as one line: "delay=20ms jitter=5ms loss=2%". Fields at zero are left out, except the
/// delay; a histogram is written out (histogram=0.56ms:72,0.5877ms:5058,…), so that the line alone
/// replays a run. parse_profile(to_string(p)) == p exactly, for every p that passes check().
std::string to_string(const Profile& profile);

/// Reads such a line. Durations take ns, us, ms or s and are rounded to whole nanoseconds;
/// probabilities are 2% or 0.02. Throws std::invalid_argument naming field, value and what was
/// expected; the result has passed check().
Profile parse_profile(std::string_view line);

/// Reads a measured histogram: one bin per line, its lower edge in ms and its count or share,
/// separated by a comma, a semicolon, tabs or blanks; `#` starts a comment. Throws
/// std::invalid_argument naming file and line.
std::vector<Profile::Bin> histogram_from_csv(const std::filesystem::path& file);

}  // namespace tendon::injector
