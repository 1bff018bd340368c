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

/// What a scene runs in its haptic thread, what it does not, and what each part costs there: `tendond explain SCENE`.
///
/// Costs are measured, here and now: processor time of HapticLoop::step with the scene's device, which feels a spring
/// of 500 N/m that answers every tenth step. The cost of a part is the difference to the same scene without it. It is
/// below 0 where other parts have more to do then. The cost of the device is the difference to the same scene with its
/// first 2000 positions played back, so it is never more than the step. Each cost is the least of 80 rounds of 200
/// steps, in which all take turns. `resolution_ns` is the most by which two measurements of the same thing differed;
/// a smaller cost cannot be told from none.
struct Explanation {
  struct Part {
    std::string_view key;           ///< of the scene
    std::string_view what;          ///< one line
    std::optional<double> cost_ns;  ///< of a step; empty when it is not listed: it does not exist then
  };
  std::vector<Part> parts;
  double step_ns = 0;    ///< a whole step
  double device_ns = 0;  ///< the share of the simulated device with its hand in that, from 0 to step_ns
  double resolution_ns = 0;
};

/// `processor_time` of the calling thread. The least of each `rounds` counts; 80 take a quarter of a second.
Explanation explain(const Scene& scene, const std::function<Duration()>& processor_time, int rounds = 80);

/// For people; and a JSON object in one line.
std::string in_words(const Scene& scene, const Explanation& explanation);
std::string in_json(const Scene& scene, const Explanation& explanation);

}  // namespace tendon
