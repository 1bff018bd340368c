// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string_view>

#include "core/base/arithmetic.h"
#include "protocol/limits.h"
#include "protocol/messages.h"

// Checks values against the bounds of the wire (limits.h).
//
// Realtime-safe.

namespace tendon {

/// Returns false for NaN.
inline bool bounded(double value) noexcept { return std::abs(value) <= limits::kMaxValue; }

/// Returns true if the force of `command`, its model and its error are within the bounds that a receiver checks
/// (WIRE.md).
bool in_bounds(const ForceCommand& command) noexcept;

/// Returns the name of the first field that is out of bounds, or an empty string. The name has static storage. The
/// device and the channel are not checked.
std::string_view refused_field(SetOutput wanted) noexcept;
std::string_view refused_field(SetScale wanted) noexcept;
std::string_view refused_field(SetShare wanted) noexcept;

/// Returns true if `command` contains no NaN, and no infinity except for the `valid_radius` of a model.
bool is_finite(const ForceCommand& command) noexcept;

/// Explains to the author of an engine why `command` is out of bounds. Empty if it is not. The text has static storage.
std::string_view objection(const ForceCommand& command) noexcept;

}  // namespace tendon
