// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <vector>

#include "clients/softbody/models/quasi_static.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/dice.h"

namespace tendon::softbody::testing {

/// A block in the hands of a model that is asked, and of Newton's method on the whole mesh, which knows.
struct AskedAndExact {
  explicit AskedAndExact(Solid block)
      : solid(std::move(block)),
        top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius),
        exact(solid, top, {.max_iterations = 200, .tolerance = 1e-9}) {}
  Solid solid;
  TouchSurface top;
  QuasiStaticModel exact;
  std::unique_ptr<Model> asked{};
};

struct ErrorsSaid {
  int answers = 0;
  int covered = 0;                 ///< answers whose error is at least the true one
  std::vector<double> times = {};  ///< the error said over the true one, where that is above 0.5 % of the force; sorted
  double median() const { return times.empty() ? 0 : times[times.size() / 2]; }
};

/// Ten answers on each of `paths`: presses and strokes as they come, in steps of 0.1 to 10 mm at most, down to `deepest`
/// (m). `block_of(path, tolerance)` makes the block of a path, which is asked for 0.3 to 30 %. Seed 1.
template <class BlockOf>
ErrorsSaid errors_said(int paths, double deepest, const BlockOf& block_of) {
  constexpr int kAnswers = 10;
  Dice dice(1);
  ErrorsSaid said;
  for (int path = 0; path < paths; ++path) {
    const std::unique_ptr<AskedAndExact> block = block_of(path, dice.decades(-2.5, -0.5));
    const double widest = dice.decades(-4, -2);  // m, between two answers
    Vec2 place(dice.within(-0.02, 0.02), dice.within(-0.02, 0.02));
    double depth = 0;
    for (int i = 0; i < kAnswers; ++i) {
      const auto moved = [&](double from, double low, double high) {
        return std::clamp(from + dice.within(-widest, widest), low, high);
      };
      place = Vec2(moved(place.x(), -0.03, 0.03), moved(place.y(), -0.03, 0.03));
      depth = moved(depth + widest / 3, 2e-4, deepest);
      const Patch patch = *block->top.patch(place);
      const Reaction found = block->asked->press(patch, Given::kDepth, depth);
      const double truth = block->exact.press(patch, Given::kDepth, depth).force;
      const double wrong = std::abs(found.force - truth);
      ++said.answers;
      said.covered += wrong <= found.error + 1e-9 * std::abs(truth) ? 1 : 0;
      if (wrong > 5e-3 * std::abs(truth)) said.times.push_back(found.error / wrong);
    }
  }
  std::ranges::sort(said.times);
  return said;
}

}  // namespace tendon::softbody::testing
