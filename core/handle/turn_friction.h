// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendon {

/// The maximum ratio of the viscous friction of rotation that a limiter uses to the true friction. HandlePort assumes a
/// constant axis during the interval. If the axis turns, the booked energy can exceed the true energy by 2 % of the
/// viscous friction (core/PROOFS.md, "Several coordinates").
inline constexpr double kTurnFrictionShare = 0.98;

}  // namespace tendon
