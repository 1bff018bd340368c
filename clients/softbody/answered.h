// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/softbody/near/ladder.h"

namespace tendon::softbody {

/// How a kNear body has answered: the statistics that tendon-softbody prints when it ends. Empty for other bodies.
struct Answered {
  std::vector<Ladder::Step> rungs;      ///< Body::ladder(); empty after a cut
  std::optional<NearModel::Size> near;  ///< Body::near_field(), if a background thread makes the fields
};

/// One line for people. Empty if there is nothing to report.
std::string in_words(const Answered& answered);

/// One line of JSON, or empty: {"answers":{"tabulated":812,"learned":97,"linear":3,"fields":5,"fields_late":1}}. The
/// rungs come first, by name; "linear" and the fields only with a background thread.
std::string in_json(const Answered& answered);

}  // namespace tendon::softbody
