// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/operator_hand.h"

#include <cmath>
#include <utility>

#include "core/base/expect.h"

namespace tendon {

OperatorHand::OperatorHand(Config config) : config_(std::move(config)) {
  expect(config_.stiffness > 0 && std::isfinite(config_.stiffness), "hand.stiffness", config_.stiffness,
         "a number above 0 N/m (omit the hand for a device without one)");
  expect(config_.damping >= 0 && std::isfinite(config_.damping), "hand.damping", config_.damping, "0 N·s/m or more");
  expect(config_.mass >= 0 && std::isfinite(config_.mass), "hand.mass", config_.mass, "0 kg or more");
}

Vec3 OperatorHand::drive(double t, const Vec3& x) const noexcept {
  const ScriptedMotion::Point wanted = target(t);
  return config_.stiffness * (wanted.position - x) + config_.damping * wanted.velocity;
}

}  // namespace tendon
