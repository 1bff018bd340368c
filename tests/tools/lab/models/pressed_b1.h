// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/clients/softbody/pressed_block.h"
#include "tests/tools/lab/models/compared.h"

namespace tendon::softbody::compared::testing {

/// Damping that brings dynamic models to rest quickly.
inline Config soon_at_rest(Kind kind) {
  Config config;
  if (info(kind).has_time) config.effects = {.density = 1000, .step = 1e-3, .inertia = true, .damping = 40};
  return config;
}

/// tests/clients/softbody/pressed_block.h
inline PressedBody pressed_b1(Kind kind, Element element, int n, const Config& config, double poisson = 0.45) {
  return {kind, softbody::testing::pressed_block(element, n, poisson, info(kind).law),
          softbody::testing::kB1PatchRadius, Vec3::Zero(), config};
}
inline PressedBody pressed_b1(Kind kind, Element element, int n) {
  return pressed_b1(kind, element, n, soon_at_rest(kind));
}

}  // namespace tendon::softbody::compared::testing
