// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// A fast method for some presses (near/fallback_model.h). It has no state.
class FallbackLevel {
 public:
  FallbackLevel() = default;
  virtual ~FallbackLevel() = default;
  FallbackLevel(const FallbackLevel&) = delete;
  FallbackLevel& operator=(const FallbackLevel&) = delete;

  struct Answer {
    Reaction reaction;
    double share;  ///< between 0 and 1
  };
  /// Returns the answer at a given depth (m). Empty if the press is outside the valid region.
  virtual std::optional<Answer> press(const Patch& patch, double depth) const = 0;

  /// Returns 1 if the press is far from the border of the valid region, and 0 at the border.
  virtual double room(const Vec2& middle, double depth) const = 0;

  struct Size {
    std::string_view name;
    int shapes = 0;
    std::size_t elements = 0;
    std::size_t bytes = 0;
    int cells = 0;
    int of_cells = 0;
    double error = 0;  ///< largest relative error of the force
  };
  virtual Size size() const = 0;
};

}  // namespace tendon::softbody
