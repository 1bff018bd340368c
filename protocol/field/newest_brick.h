// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "protocol/messages.h"

namespace tendon {

/// A copy of the newest brick of a session. Memory is only allocated for the first one. Thread-safe: no.
class NewestBrick {
 public:
  bool waiting = false;  ///< true until the brick is sent or returned as an event

  void put(const FieldBrick& brick) {
    waiting = true;
    hash_ = brick.hash;
    weights_.assign(brick.weights.begin(), brick.weights.end());
  }
  /// Valid until the next `put`.
  FieldBrick value() const noexcept { return {.hash = hash_, .weights = weights_}; }

 private:
  decltype(FieldBrick::hash) hash_{};
  std::vector<std::byte> weights_;
};

}  // namespace tendon
