// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendon {

/// The share of a rotation's true viscous friction that a limiter may count on at most. HandlePort books a turn as if
/// its axis stayed the same during the interval; a wandering axis takes up to 2 % of the viscous friction more than is
/// booked.
inline constexpr double kTurnFrictionShare = 0.98;

}  // namespace tendon
