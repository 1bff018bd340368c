// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// The data of one period of a Coupling for the other parts of a handle (TurnCoupling, GripCoupling). Their force is
///     gain · law  +  (1 − gain) · spring that holds the position of a robot  +  fade · left
/// where `left` is the difference to the previous force when the source of the force changes.
struct CouplingPeriod {
  bool in_act = false;    ///< true if engaged, also with the clutch
  bool live = false;      ///< the motion of the handle is sent
  bool driven = false;    ///< the law computes the force
  bool changed = false;   ///< true if `driven` has changed or an engagement has started
  bool placed = false;    ///< a robot starts to hold its current position
  bool holds = false;     ///< a robot holds a position
  bool fault = false;     ///< the force is 0
  double gain = 0;        ///< 0 … 1, of the ramp
  double fade = 0;        ///< 0 … 1
  Duration round_trip{};  ///< 0 if it is not known
  double ahead = 0;       ///< s, additional delay of the newest state, compared with the fastest ones (≤ 20 ms)
};

}  // namespace tendon
