// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "clients/softbody/near/ladder.h"
#include "clients/softbody/near/learn.h"
#include "tests/clients/softbody/drawn_answers.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::testing {

/// B1 of n cells, and what it knows of presses within `reach` of its middle.
struct PressedBefore : AskedAndExact {
  PressedBefore(int n, double poisson, Law law, double reach)
      : AskedAndExact(pressed_block(Element::kHex8Sri, n, poisson, law)),
        presses(solve_presses(solid, top, PressGrid::over(Vec2::Zero(), reach, kB1PatchRadius), true, {})),
        shapes(learn_shapes(solid, top, presses, {})),
        answers(tabulate(presses)) {}

  std::unique_ptr<NearModel> near(double tolerance) const {
    return std::make_unique<NearModel>(solid, top, *top.patch(Vec2::Zero()),
                                       NearModel::Config{.newton = {.max_iterations = 100, .tolerance = tolerance}});
  }
  std::unique_ptr<Rung> learned(double tolerance) const {
    return std::make_unique<LearnedRung>(solid, top, shapes, tolerance);
  }
  std::unique_ptr<Rung> tabulated(double tolerance) const {
    return std::make_unique<TabulatedRung>(answers, tolerance);
  }
  double truth(const Vec2& place, double depth) { return exact.press(*top.patch(place), Given::kDepth, depth).force; }

  SolvedPresses presses;
  LearnedShapes shapes;
  TabulatedAnswers answers;
};

/// n = 6, answered as far as 5 mm from the middle, one for each law; made once.
inline PressedBefore& small_block(Law law) {
  static PressedBefore neo_hookean(6, 0.45, Law::kNeoHookean, 0.005);
  static PressedBefore corotational(6, 0.45, Law::kCorotational, 0.005);
  return law == Law::kNeoHookean ? neo_hookean : corotational;
}

}  // namespace tendon::softbody::testing
