// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <string_view>

#include "core/base/arithmetic.h"
#include "protocol/limits.h"
#include "protocol/messages.h"

// Checks of the bounds in limits.h. Realtime-safe.

namespace tendon {

inline bool bounded(double value) noexcept { return std::abs(value) <= limits::kMaxValue; }  ///< false for NaN

/// Checks the force, the model and the error of `command`, using the bounds of a receiver (WIRE.md).
bool in_bounds(const ForceCommand& command) noexcept;

/// Returns the first field out of bounds, or an empty string, in static storage. Ignores device and channel, and the
/// generation of a field.
std::string_view refused_field(SetOutput wanted) noexcept;
std::string_view refused_field(SetScale wanted) noexcept;
std::string_view refused_field(SetShare wanted) noexcept;
std::string_view refused_field(UseField wanted);

/// Returns false if `command` contains NaN, or infinity except for the `valid_radius` of a model.
bool is_finite(const ForceCommand& command) noexcept;

/// Explains to the author of an engine why `command` is out of bounds. Empty if it is not. In static storage.
std::string_view objection(const ForceCommand& command) noexcept;

}  // namespace tendon
