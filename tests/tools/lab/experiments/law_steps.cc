// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/law_steps.h"

#include "tests/tools/lab/experiments/paper.h"

namespace tendon::lab {

LimiterConfig measured_limiter(Law law) {
  return {.law = law,
          .friction = LawSteps::kFriction,
          .longest_hold = std::chrono::milliseconds(1),
          .max_force = kPaperMaxForce,
          .environment_stiffness = LawSteps::kStiffness,
          .environment_delay = LawSteps::kEnvironmentDelay};
}

LawSteps::LawSteps(const LimiterConfig& config) : law_(config) {
  const PrescribedMotion motion = paper_motion(config.friction, kPaperEncoder);
  for (std::size_t i = 0; i < kPeriod; ++i) places_[i] = motion.position(static_cast<double>(i) * 4e-3);
}

}  // namespace tendon::lab
