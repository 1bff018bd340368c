// SPDX-License-Identifier: Apache-2.0
#include "core/base/reason.h"

#include <array>
#include <utility>

namespace tendon {

std::string to_string(Reasons reasons) {
  static constexpr std::array<std::pair<Reason, const char*>, 16> kNames = {{
      {Reason::kEnergy, "energy"},
      {Reason::kMaxForce, "max force"},
      {Reason::kSlew, "slew"},
      {Reason::kRampIn, "ramp-in"},
      {Reason::kHeld, "held"},
      {Reason::kDecaying, "decaying"},
      {Reason::kSafeStop, "safe stop"},
      {Reason::kNotFinite, "not finite"},
      {Reason::kFault, "fault"},
      {Reason::kDeviceClamp, "device clamp"},
      {Reason::kOverrun, "overrun"},
      {Reason::kWatchdog, "watchdog"},
      {Reason::kUnseen, "unseen"},
      {Reason::kDisarmed, "disarmed"},
      {Reason::kDamped, "damped"},
      {Reason::kAcceleration, "acceleration"},
  }};
  std::string text;
  for (const auto& [reason, name] : kNames) {
    if (!reasons.has(reason)) continue;
    if (!text.empty()) text += ", ";
    text += name;
  }
  return text;
}

}  // namespace tendon
