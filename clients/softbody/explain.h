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

/// The report of `tendon-softbody explain SCENE`: the effects of a scene and their costs, measured on this machine. The
/// cost of an answer is the mean processor time while a tool presses 3 mm into the body and returns, and the minimum of
/// up to 4 rounds. The cost of an effect is the difference to the same scene without the effect, and can be negative.
struct Explanation {
  struct Cost {
    double answer_s = 0;
    std::int64_t bytes = 0;
  };
  struct Part {
    EffectKind kind;
    bool simulated;
    std::optional<Cost> adds;  ///< empty for necessary effects
  };
  std::vector<Part> parts;
  Cost all;
  double resolution_s = 0;  ///< costs below this value are noise
  Body::Size size;
  std::optional<NearModel::Size> near;
  struct Tool {
    RigidShape::MeshFacts facts;
    double made_s;
  };
  std::optional<Tool> tool;
  std::optional<double> off_exact;
  struct Beside {  // the background thread; empty if it makes no fields
    double field_s = 0;
    std::size_t bytes = 0;
  };
  std::optional<Beside> beside;
  struct Learned {  // the cost of an answer for each level of the FallbackModel
    FallbackLevel::Size size;
    double answer_s = 0;
  };
  std::vector<Learned> learned;
  double near_answer_s = 0;
  double step = 0;          ///< time of one answer, s
  double stiffness = 0;     ///< at first touch, N/m
  double linear_up_to = 0;  ///< m
};

/// Returns the largest relative difference of the force between 60 modes and the exact interface, at three depths down
/// to a fifth of the patch radius. Throws std::invalid_argument if the model is not kNear.
double off_the_exact_interface(const BodyConfig& body);

/// `processor_time` returns the processor time of the calling thread in s.
Explanation explain(const Scene& scene, const std::function<double()>& processor_time);

std::string in_words(const Scene& scene, const Explanation& explanation);
std::string in_json(const Scene& scene, const Explanation& explanation);

struct Answered {  // statistics of a kNear body; empty for other bodies
  std::vector<FallbackModel::Step> levels;
  std::optional<NearModel::Size> near;
};

std::string in_words(const Answered& answered);  ///< one line, or empty if there is nothing to report

/// Returns a line of JSON: {"answers":{"tabulated":812,"learned":97,"linear":3,"fields":5,"fields_late":1}}.
std::string in_json(const Answered& answered);

}  // namespace tendon::softbody
