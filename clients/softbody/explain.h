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
/// Costs are measured on this machine, now: the processor time of an answer, averaged over a tool that presses 3 mm
/// into the middle and comes back. The bodies take turns, and each cost is the least of up to 4 rounds. The cost of an
/// effect is the difference to the same scene without it. It is below 0 when the other effects cost more without it.
struct Explanation {
  struct Cost {
    double answer_s = 0;     ///< s of processor time
    std::int64_t bytes = 0;  ///< kept by the model
  };
  struct Part {
    EffectKind kind;
    bool simulated;
    std::optional<Cost> adds;  ///< for effects that can be left out
  };
  std::vector<Part> parts;  ///< every effect
  Cost all;
  double resolution_s = 0;  ///< the difference of two measurements of the same body; smaller costs mean nothing
  Body::Size size;
  std::optional<NearModel::Size> near;  ///< of the model "near"
  /// A tool that a file describes.
  struct Tool {
    RigidShape::MeshFacts facts;
    double made_s;  ///< s of processor time, at each start
  };
  std::optional<Tool> tool;
  std::optional<double> off_exact;  ///< off_the_exact_interface(), where it has been asked for
  /// The thread that makes near fields beside the answers; empty where no field is made, or two threads may not factorise
  /// at once, so that answers make them.
  struct Beside {
    double field_s = 0;     ///< s of processor time for a field
    std::size_t bytes = 0;  ///< that it keeps
  };
  std::optional<Beside> beside;
  /// What answers before the near field, the first one first; and what an answer costs where it is the first.
  struct Learned {
    Rung::Size size;
    double answer_s = 0;  ///< s of processor time
  };
  std::vector<Learned> learned;
  double near_answer_s = 0;  ///< s, of the near field, where something answers before it
  double step = 0;           ///< s, the time step of an answer; 0: the body is at rest at every instant
  double stiffness = 0;      ///< N/m, at first touch
  double linear_up_to = 0;   ///< m; see Body
};

/// By how much of the force 60 modes answer otherwise than the exact interface of near and far, at the most of three
/// depths down to a fifth of the patch's radius: a check of the model "near", which takes the time of some whole
/// solutions. Throws std::invalid_argument for another model.
double off_the_exact_interface(const BodyConfig& body);

/// `processor_time` of the calling thread, s.
Explanation explain(const Scene& scene, const std::function<double()>& processor_time);

/// The explanation for people, with the warnings about the scene; and as a JSON object in one line.
std::string in_words(const Scene& scene, const Explanation& explanation);
std::string in_json(const Scene& scene, const Explanation& explanation);

}  // namespace tendon::softbody
