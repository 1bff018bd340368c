// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/softbody/near/fallback_model.h"

namespace tendon::softbody {

/// The statistics of a kNear body. They are empty for other bodies.
struct Answered {
  std::vector<FallbackModel::Step> levels;
  std::optional<NearModel::Size> near;
};

/// Returns one line of text, or an empty string if there is nothing to report.
std::string in_words(const Answered& answered);

/// Returns a line of JSON: {"answers":{"tabulated":812,"learned":97,"linear":3,"fields":5,"fields_late":1}}.
std::string in_json(const Answered& answered);

}  // namespace tendon::softbody
