// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>

#include "clients/softbody/models/model.h"
#include "clients/softbody/touch/contact.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::testing {

class SameAnswer : public Model {
 public:
  explicit SameAnswer(Reaction reaction) : reaction_(std::move(reaction)) {}
  Reaction press(const Patch&, Prescribed, double) override { return reaction_; }
  bool glides() const noexcept override { return true; }
  std::size_t bytes() const noexcept override { return 0; }

 private:
  Reaction reaction_;
};

/// A reaction of 2 N at 4 mm with all parts of the stiffness set.
inline Reaction whole_answer() {
  Reaction answer;
  answer.force = 2;
  answer.depth = 4e-3;
  answer.stiffness = 400;
  answer.slope = Vec2(0.1, -0.2);
  answer.error = 0.01;
  answer.knows_glide = true;
  answer.glide.tilting = Vec2(3, 5);
  answer.glide.curving << 7, 1, 1, -4;
  answer.glide.giving << 20, 3, 3, 30;
  return answer;
}

inline Feel felt(const Reaction& answer) {
  const Solid solid = pressed_block(Element::kHex8Sri, 8, 0.45);
  const TouchSurface slanting(solid.mesh(), Vec3(0.3, -0.2, 1).normalized(), kB1PatchRadius);
  SameAnswer model(answer);
  return PatchContact(model, slanting, 0, PatchContact::Side::kUnilateral).at(Vec3(0.001, 0.002, 0.046));
}

}  // namespace tendon::softbody::testing
