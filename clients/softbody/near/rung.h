// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// A fast way to answer some presses of a body; near/ladder.h tries several in order. Stateless: the same press has the
/// same answer.
class Rung {
 public:
  Rung() = default;
  virtual ~Rung() = default;
  Rung(const Rung&) = delete;
  Rung& operator=(const Rung&) = delete;

  struct Answer {
    Reaction reaction;
    double share;  ///< in (0, 1]; if below 1, the next rung contributes the rest
  };
  /// The answer to a patch at the given depth, m. Empty if this rung does not cover the press.
  virtual std::optional<Answer> press(const Patch& patch, double depth) const = 0;

  /// Distance to where the share falls below 1: 0 there, 1 far from it, linear in between. Computes no answer.
  virtual double room(const Vec2& middle, double depth) const = 0;

  struct Size {
    std::string_view name;
    int shapes = 0;            ///< unknowns
    std::size_t elements = 0;  ///< that are summed over
    std::size_t bytes = 0;
    int cells = 0;  ///< grid cells in which it may answer
    int of_cells = 0;
    double error = 0;  ///< largest relative force error in those cells
  };
  virtual Size size() const = 0;
};

}  // namespace tendon::softbody
