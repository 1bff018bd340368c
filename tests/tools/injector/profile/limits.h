// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

// What a profile may hold. limits.cc has check(Profile), which asks for all of it; the readers of tables and fields ask
// for the parts below, so that a complaint names the line that it is about.

inline constexpr std::uint64_t kMaxQueueBytes = std::uint64_t{1} << 30;
inline constexpr std::uint64_t kMaxRate = 1'000'000'000'000;  ///< bit/s

/// Throws std::invalid_argument when `value` is not within `least` … `most`.
void check_duration(const std::string& field, Duration value, Duration least = {}, Duration most = kMaxDelay);

/// What is wrong with `entry`, which follows `previous`, if anything.
std::optional<std::string> complaint(const Weighted* previous, const Weighted& entry);

}  // namespace tendon::injector
