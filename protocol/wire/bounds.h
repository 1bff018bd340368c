// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string_view>

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
/// … and all else of it: it has a sequence, a validity, and numbers of a device and a channel.
bool is_receivable(const ForceCommand& command) noexcept;

/// Whether a receiver accepts that state.
bool in_bounds(const DeviceState& state) noexcept;

/// Whether a receiver accepts that setting; the number of the device is another matter.
bool in_bounds(const SetOutput& wanted) noexcept;

/// Whether a receiver accepts those scales, and that share; the numbers of device and channel are another matter.
bool in_bounds(const SetScale& wanted) noexcept;
bool in_bounds(const SetShare& wanted) noexcept;

/// Whether `command` holds no NaN, and no infinity except as a model's `valid_radius`.
bool is_finite(const ForceCommand& command) noexcept;

/// Why `command` is not in bounds, for the author of the engine that it comes from; empty when it is. Of static
/// storage.
std::string_view objection(const ForceCommand& command) noexcept;

}  // namespace tendon
