// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

// check(Profile) applies all limits. The readers of tables and fields call the functions below, so that errors name the
// line.

inline constexpr std::uint64_t kMaxQueueBytes = std::uint64_t{1} << 30;
inline constexpr std::uint64_t kMaxRate = 1'000'000'000'000;  ///< bit/s

/// Throws std::invalid_argument if `value` is not in the range [least, most].
void check_duration(const std::string& field, Duration value, Duration least = {}, Duration most = kMaxDelay);

std::optional<std::string> complaint(const Weighted* previous, const Weighted& entry);

}  // namespace tendon::injector
