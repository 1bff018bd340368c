// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "clients/softbody/near/ladder.h"

namespace tendon::softbody {

/// How a body of the model "near" has answered: what tendon-softbody says at its end. Another body has nothing to say.
struct Answered {
  std::vector<Ladder::Step> rungs;      ///< Body::ladder(); none after a cut
  std::optional<NearModel::Size> near;  ///< Body::near_field(), where another thread makes its fields
};

/// For people, in one line. Empty: nothing to say.
std::string in_words(const Answered& answered);

/// The same as a JSON object in one line, or empty: {"answers":{"tabulated":812,"learned":97,"linear":3,"fields":5,
/// "fields_late":1}}. The rungs come first, by their names; "linear" and the fields only with another thread.
std::string in_json(const Answered& answered);

}  // namespace tendon::softbody
