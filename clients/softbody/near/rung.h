// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// A way of answering some presses of a body faster than its model does: near/ladder.h asks several, the fastest first.
/// A rung remembers nothing: the same press has the same answer.
class Rung {
 public:
  Rung() = default;
  virtual ~Rung() = default;
  Rung(const Rung&) = delete;
  Rung& operator=(const Rung&) = delete;

  struct Answer {
    Reaction reaction;
    double share;  ///< above 0 and at most 1: below 1 the next rung has the rest
  };
  /// The answer to a patch at a held depth, m. Empty where this rung knows too little of it.
  virtual std::optional<Answer> press(const Patch& patch, double depth) const = 0;

  /// How much room a press has until a share is below 1: 0 there, 1 far from it, and evenly between. A rung says so
  /// without an answer.
  virtual double room(const Vec2& middle, double depth) const = 0;

  struct Size {
    std::string_view name;
    int shapes = 0;            ///< unknowns
    std::size_t elements = 0;  ///< that are summed over
    std::size_t bytes = 0;
    int cells = 0;  ///< of the grid of places and depths, in which it may answer
    int of_cells = 0;
    double error = 0;  ///< of the force, the largest share that is said in those
  };
  virtual Size size() const = 0;
};

}  // namespace tendon::softbody
