// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/phases/force_ramp.h"

#include <algorithm>

#include "core/teleoperation/port_values.h"

namespace tendon {

ForceRamp::Change ForceRamp::drive(bool driven, bool new_act, Duration elapsed, Duration ramp) noexcept {
  const bool turned = driven != was_driven_ || new_act;
  const bool ended = !driven || (was_driven_ && new_act);
  was_driven_ = driven;
  if (turned || !driven) gain_ = 0;
  if (driven && !turned) gain_ = std::min(1.0, gain_ + seconds(elapsed) / seconds(ramp));
  return {turned, ended};
}

Vec3 ForceRamp::fade(const Vec3& force, bool stepped, bool fault, Duration elapsed, double most) noexcept {
  fade_ = stepped ? 1 : std::max(0.0, fade_ - seconds(elapsed) / seconds(kFade));
  if (fault) fade_ = 0;
  if (stepped) left_ = last_ - force;
  last_ = fade_ > 0 ? at_most(Vec3(force + fade_ * left_), most) : force;
  return last_;
}

void ForceRamp::skip(bool driven, Duration elapsed) noexcept {
  was_driven_ = was_driven_ && driven;
  last_.setZero();
  const double share = seconds(elapsed) / seconds(kFade);
  gain_ = std::max(0.0, gain_ - share);
  fade_ = std::max(0.0, fade_ - share);
}

}  // namespace tendon
