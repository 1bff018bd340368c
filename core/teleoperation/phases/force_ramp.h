// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"
#include "core/base/time.h"

namespace tendon {

/// Avoids steps in the force when the source of the force changes. The force of a new source is multiplied by a gain
/// that increases from 0 to 1 within `ramp`. The difference to the previous force decreases to 0 within kFade. In each
/// period, the caller must call `drive` and then `fade`, or `skip` if there is no position. Thread-safe: no.
/// Realtime-safe: yes.
class ForceRamp {
 public:
  static constexpr Duration kFade = std::chrono::milliseconds(50);

  struct Change {
    bool turned = false;  ///< true if the source of the force has changed
    bool ended = false;   ///< true if the previous source no longer exists
  };
  /// `driven` is true if the law computes the force, and `new_act` is true if a new act has started.
  Change drive(bool driven, bool new_act, Duration elapsed, Duration ramp) noexcept;

  /// Returns the sum of `force` and the decreasing difference in N, with a norm of at most `most`. If `stepped` is
  /// true, the difference is set to the change of the force. If `fault` is true, the difference is 0.
  Vec3 fade(const Vec3& force, bool stepped, bool fault, Duration elapsed, double most) noexcept;

  /// Sets the force to 0 and decreases the gain.
  void skip(bool driven, Duration elapsed) noexcept;

  double gain() const noexcept { return gain_; }  ///< 0 … 1
  double fading() const noexcept { return fade_; }
  const Vec3& force() const noexcept { return last_; }  ///< last force, N

 private:
  bool was_driven_ = false;
  double gain_ = 0;
  double fade_ = 0;           ///< factor of `left_`
  Vec3 left_ = Vec3::Zero();  ///< N, the difference
  Vec3 last_ = Vec3::Zero();
};

}  // namespace tendon
