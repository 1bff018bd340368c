// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/time.h"

namespace tendon {

/// What the laws for the rest of a handle (TurnCoupling, GripCoupling) have to know of a period of their Coupling. The
/// force that they want is, like the coupling's,
///
///     gain · law  +  (1 − gain) · spring of the place that a robot holds  +  fade · left
///
/// left: by how much the force was above the present one when what makes it changed.
struct CouplingPeriod {
  bool in_act = false;    ///< engaged or clutched
  bool live = false;      ///< what the handle does is told
  bool driven = false;    ///< the law makes the force
  bool changed = false;   ///< … or does no longer, since the last period; or does so by another act
  bool placed = false;    ///< a robot takes the place where it is now, to hold it
  bool holds = false;     ///< … and has such a place
  bool fault = false;     ///< no force
  double gain = 0;        ///< 0 … 1, the ramp
  double fade = 0;        ///< 0 … 1
  Duration round_trip{};  ///< in use; 0: not known
  double ahead = 0;       ///< s: so much later than the quickest ones has the peer's newest state come (≤ 20 ms)
};

}  // namespace tendon
