// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/softbody/near/fallback_model.h"

namespace tendon::softbody {

struct Answered {  // statistics of a kNear body; empty for other bodies
  std::vector<FallbackModel::Step> levels;
  std::optional<NearModel::Size> near;
};

std::string in_words(const Answered& answered);  ///< one line, or empty if there is nothing to report

/// Returns a line of JSON: {"answers":{"tabulated":812,"learned":97,"linear":3,"fields":5,"fields_late":1}}.
std::string in_json(const Answered& answered);

}  // namespace tendon::softbody
