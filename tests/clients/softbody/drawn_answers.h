// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/touch/contact.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/dice.h"
#include "tests/support/property_cases.h"

namespace tendon::softbody::testing {

struct AskedAndExact {
  explicit AskedAndExact(Solid block)
      : solid(std::move(block)),
        top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius),
        exact(solid, top, {.max_iterations = 200, .tolerance = 1e-9}) {}
  double truth(const Vec2& place, double depth) {
    return exact.press(*top.patch(place), Prescribed::kDepth, depth).force;
  }
  Solid solid;
  TouchSurface top;
  QuasiStaticModel exact;
  std::unique_ptr<Model> asked{};
};

/// The force differs from the true one by at most `share` of it, and the reported error covers the difference.
template <class... What>
void expect_right(const Reaction& found, double truth, double share, const What&... what) {
  std::ostringstream text;
  ((text << what << ' '), ...);
  EXPECT_NEAR(found.force, truth, share * truth) << text.str();
  EXPECT_GE(found.error, std::abs(found.force - truth)) << text.str();
}

/// `Answer` is Reaction or Feel.
template <class Answer>
void expect_same_bits(const Answer& found, const Answer& expected, int answer) {
  EXPECT_EQ(found.force, expected.force) << answer;
  EXPECT_EQ(found.stiffness, expected.stiffness) << answer;
  EXPECT_EQ(found.error, expected.error) << answer;
}

struct ErrorsSaid {
  int answers = 0;
  int covered = 0;                 ///< answers whose reported error is at least the true error
  std::vector<double> times = {};  ///< reported over true error if the latter is above 0.5 % of the force; sorted
  double median() const { return times.empty() ? 0 : times[times.size() / 2]; }
};

/// Asks for ten answers on each of several random paths of presses and strokes, with steps of up to 0.1 to 10 mm and
/// depths down to `deepest` (m). `block_of(path, tolerance)` returns the block for a path; the tolerance is 0.3 to 30
/// %. There are four paths, or twenty with ten thousand property cases. The seed is 1.
template <class BlockOf>
ErrorsSaid errors_said(double deepest, const BlockOf& block_of) {
  const int paths = property_cases() >= 10'000 ? 20 : 4;
  constexpr int kAnswers = 10;
  Dice dice(1);
  ErrorsSaid said;
  for (int path = 0; path < paths; ++path) {
    const std::unique_ptr<AskedAndExact> block = block_of(path, dice.decades(-2.5, -0.5));
    const double widest = dice.decades(-4, -2);  // longest step between two answers, m
    Vec2 place(dice.within(-0.02, 0.02), dice.within(-0.02, 0.02));
    double depth = 0;
    for (int i = 0; i < kAnswers; ++i) {
      const auto moved = [&](double from, double low, double high) {
        return std::clamp(from + dice.within(-widest, widest), low, high);
      };
      place = Vec2(moved(place.x(), -0.03, 0.03), moved(place.y(), -0.03, 0.03));
      depth = moved(depth + widest / 3, 2e-4, deepest);
      const Patch patch = *block->top.patch(place);
      const Reaction found = block->asked->press(patch, Prescribed::kDepth, depth);
      const double truth = block->exact.press(patch, Prescribed::kDepth, depth).force;
      const double wrong = std::abs(found.force - truth);
      ++said.answers;
      said.covered += wrong <= found.error + 1e-9 * std::abs(truth) ? 1 : 0;
      if (wrong > 5e-3 * std::abs(truth)) said.times.push_back(found.error / wrong);
    }
  }
  std::ranges::sort(said.times);
  return said;
}

/// The reported error covers the true error in 99 of 100 answers, and its median is at most 20 times as large.
inline void expect_covered(const ErrorsSaid& said) {
  EXPECT_GE(said.answers, 40);
  EXPECT_GE(said.covered, said.answers * 99 / 100);
  EXPECT_LE(said.median(), 20) << said.times.size();
  EXPECT_TRUE(said.answers < 200 || !said.times.empty());
  ::testing::Test::RecordProperty("covered", said.covered);
  ::testing::Test::RecordProperty("above_half_a_percent", static_cast<int>(said.times.size()));
  ::testing::Test::RecordProperty("median_of_said_over_true", static_cast<int>(said.median()));
}

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
