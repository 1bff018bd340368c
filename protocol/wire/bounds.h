// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string_view>

#include "core/base/arithmetic.h"
#include "protocol/limits.h"
#include "protocol/messages.h"

// Whether values are within the bounds of the wire (limits.h).
//
// Realtime-safe.

namespace tendon {

/// False for NaN, too.
inline bool bounded(double value) noexcept { return std::abs(value) <= limits::kMaxValue; }

/// Whether a receiver accepts what `command` says of the force: `force`, `model` and `error` are within their bounds
/// (WIRE.md).
bool in_bounds(const ForceCommand& command) noexcept;

/// Returns the name of the first field that is out of bounds, or an empty string. The name is in static storage. This
/// does not check the device and the channel.
std::string_view refused_field(SetOutput wanted) noexcept;
std::string_view refused_field(SetScale wanted) noexcept;
std::string_view refused_field(SetShare wanted) noexcept;

/// Whether `command` holds no NaN, and no infinity except as a model's `valid_radius`.
bool is_finite(const ForceCommand& command) noexcept;

/// Why `command` is not in bounds, for the author of the engine that it comes from; empty when it is. Of static
/// storage.
std::string_view objection(const ForceCommand& command) noexcept;

}  // namespace tendon
