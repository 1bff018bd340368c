// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "server/scene/scene.h"

namespace tendon {

/// The cost of each part of a scene in the haptic thread, measured as the processor time of HapticLoop::step. The
/// scene's device is coupled to a spring of 500 N/m, which is updated in every tenth step. The cost of a part is the
/// difference between the scene with and without this part. It can be negative if other parts then have more work. The
/// cost of the device is the difference to a playback of its first 2000 positions, so it does not exceed the cost of
/// the step. Each cost is the minimum of 80 rounds of 200 steps. It is not significant below `resolution_ns`.
struct Explanation {
  struct Part {
    std::string_view key;
    std::string_view what;
    std::optional<double> cost_ns;  ///< per step; empty if it is not part of the scene
  };
  std::vector<Part> parts;
  double step_ns = 0;
  double device_ns = 0;  ///< from 0 to step_ns; the simulated device and its hand
  double resolution_ns = 0;
};

/// `processor_time` returns the processor time of the calling thread. With 80 rounds, this takes about 0.25 s.
Explanation explain(const Scene& scene, const std::function<Duration()>& processor_time, int rounds = 80);

std::string in_words(const Scene& scene, const Explanation& explanation);
std::string in_json(const Scene& scene, const Explanation& explanation);

}  // namespace tendon
