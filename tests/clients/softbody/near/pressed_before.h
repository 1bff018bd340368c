// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "clients/softbody/near/fallback_model.h"
#include "clients/softbody/near/learn.h"
#include "tests/clients/softbody/drawn_answers.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::testing {

/// Block B1 with n cells, and the precomputed presses within `reach` of its center.
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
  std::unique_ptr<FallbackLevel> learned(double tolerance) const {
    return std::make_unique<LearnedLevel>(solid, top, shapes, tolerance);
  }
  std::unique_ptr<FallbackLevel> tabulated(double tolerance) const {
    return std::make_unique<TabulatedLevel>(answers, tolerance);
  }

  SolvedPresses presses;
  LearnedShapes shapes;
  TabulatedAnswers answers;
};

/// Block B1 with `n` cells and the presses within 5 mm of its center. It is computed at the first use of each law.
template <int n>
PressedBefore& block_of(Law law) {
  static std::map<Law, PressedBefore> made;
  return made.try_emplace(law, n, 0.45, law, 0.005).first->second;
}
inline PressedBefore& small_block(Law law) { return block_of<6>(law); }

}  // namespace tendon::softbody::testing
