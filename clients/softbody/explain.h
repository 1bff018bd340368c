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

/// What `tendon-softbody explain SCENE` reports: which effects a scene simulates, and the cost of each.
///
/// Costs are measured on this machine: the mean processor time of an answer while a tool presses 3 mm into the center
/// and returns. The bodies are measured in turn, and each cost is the minimum of up to 4 rounds. The cost of an effect
/// is the difference to the scene without it; it is negative if the other effects cost more without it.
struct Explanation {
  struct Cost {
    double answer_s = 0;     ///< s of processor time
    std::int64_t bytes = 0;  ///< of the model
  };
  struct Part {
    EffectKind kind;
    bool simulated;
    std::optional<Cost> adds;  ///< for optional effects
  };
  std::vector<Part> parts;  ///< all effects
  Cost all;
  double resolution_s = 0;  ///< difference between two measurements of the same body; smaller costs are noise
  Body::Size size;
  std::optional<NearModel::Size> near;  ///< model "near" only
  /// A tool read from a file.
  struct Tool {
    RigidShape::MeshFacts facts;
    double made_s;  ///< s of processor time, at each start
  };
  std::optional<Tool> tool;
  std::optional<double> off_exact;  ///< off_the_exact_interface(), if requested
  /// The background thread that makes near fields. Empty if no field is made, or if two threads may not factorize
  /// concurrently, so that answers make the fields.
  struct Beside {
    double field_s = 0;     ///< s of processor time per field
    std::size_t bytes = 0;  ///< kept by the thread
  };
  std::optional<Beside> beside;
  /// The rungs above the near field, first one first, with the cost of an answer when that rung is used first.
  struct Learned {
    Rung::Size size;
    double answer_s = 0;  ///< s of processor time
  };
  std::vector<Learned> learned;
  double near_answer_s = 0;  ///< s, of the near field, if rungs precede it
  double step = 0;           ///< s simulated per answer; 0: the body is always at rest
  double stiffness = 0;      ///< N/m, at first touch
  double linear_up_to = 0;   ///< m; see Body
};

/// Largest relative force difference between 60 modes and the exact near-far interface, at three depths down to a fifth
/// of the patch radius. Checks the model "near", at the cost of some full solutions. Throws std::invalid_argument for
/// other models.
double off_the_exact_interface(const BodyConfig& body);

/// `processor_time`: of the calling thread, s.
Explanation explain(const Scene& scene, const std::function<double()>& processor_time);

/// The explanation as text, with the scene's warnings, and as one line of JSON.
std::string in_words(const Scene& scene, const Explanation& explanation);
std::string in_json(const Scene& scene, const Explanation& explanation);

}  // namespace tendon::softbody
