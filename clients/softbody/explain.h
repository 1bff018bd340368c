// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/softbody/scene.h"

namespace tendon::softbody {

/// Which effects a scene simulates, which it leaves out, and the cost of each: `tendon-softbody explain SCENE`.
///
/// Costs are measured, here and now: processor time of an answer, the mean over a tool that presses 3 mm into the
/// middle and comes back, of bodies that take turns; each is the least of up to 4 rounds. What an effect adds is the
/// difference to the same scene without it, below 0 where the others have more to do then.
struct Explanation {
  struct Cost {
    double answer_s = 0;     ///< s of processor time
    std::int64_t bytes = 0;  ///< that the model keeps
  };
  struct Part {
    EffectKind kind;
    bool simulated;
    std::optional<Cost> adds;  ///< of those that can be left out
  };
  std::vector<Part> parts;  ///< every effect
  Cost all;
  double resolution_s = 0;  ///< what two measurements of the same thing differed by; less cannot be told from nothing
  Body::Size size;
  double step = 0;          ///< s, that an answer lasts; 0: at rest at every instant
  double stiffness = 0;     ///< N/m, at first touch
  double linear_up_to = 0;  ///< m; see Body
};

/// `processor_time` of the calling thread, s.
Explanation explain(const Scene& scene, const std::function<double()>& processor_time);

/// For people, with the warnings that concern the scene; and a JSON object in one line.
std::string in_words(const Scene& scene, const Explanation& explanation);
std::string in_json(const Scene& scene, const Explanation& explanation);

}  // namespace tendon::softbody
