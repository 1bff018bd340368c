// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>

#include "clients/softbody/models/model.h"

namespace tendon::softbody::testing {

/// A body that always answers the same.
class SameAnswer : public Model {
 public:
  explicit SameAnswer(Reaction reaction) : reaction_(std::move(reaction)) {}
  Reaction press(const Patch&, Given, double) override { return reaction_; }
  bool glides() const noexcept override { return true; }
  std::size_t bytes() const noexcept override { return 0; }

 private:
  Reaction reaction_;
};

}  // namespace tendon::softbody::testing
