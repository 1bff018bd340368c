// SPDX-License-Identifier: Apache-2.0
// Effects that a scene does not list must cost nothing: instructions per step (callgrind) of a body without effects, in
// the complete program and in one built without the effects (see CMakeLists.txt).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/callgrind.h"
#include "tests/support/instruction_test.h"

namespace tendon::softbody::effects_proof_test {
namespace {

constexpr int kSteps = 6 - 2;  // between the two run lengths of softbody-proof
/// Per step; copying arrays varies with their heap address.
constexpr double kCopies = 200;

struct Cost {
  double instructions = 0;  ///< per step
  std::int64_t heap = 0;    ///< bytes
  std::int64_t bytes = 0;   ///< memory that the body reports
};
struct Body {
  std::string model;
  std::string effect;
  Cost cost;
};

/// The minimum of several runs, because CHOLMOD executes some hundred instructions only in some.
class Counted {
 public:
  Counted(std::string program, std::string which) : program_(std::move(program)), which_(std::move(which)) { again(); }
  const std::vector<Body>& bodies() const { return bodies_; }
  void again() {
    std::size_t next = 0;
    for (const auto& [line, instructions] : tendon::testing::count_instructions(program_, which_, "touch_in_turn")) {
      Body body;
      std::istringstream(line) >> body.model >> body.effect >> body.cost.heap >> body.cost.bytes;
      body.cost.instructions = instructions / kSteps;
      if (next == bodies_.size()) bodies_.push_back(body);
      double& least = bodies_[next++].cost.instructions;
      least = std::min(least, body.cost.instructions);
    }
  }

 private:
  std::string program_;
  std::string which_;
  std::vector<Body> bodies_;
};
constexpr int kRuns = 3;

bool cost_the_same(const Body& a, const Body& b) {
  return std::abs(a.cost.instructions - b.cost.instructions) <= 1e-3 * b.cost.instructions + kCopies;
}

std::string table(const std::vector<Body>& bodies) {
  std::ostringstream text;
  text << "| model | without | gravity | inertia | damping | viscosity | friction | cutting | stiffening | "
          "plasticity |\n|---|---|---|---|---|---|---|---|---|---|";
  std::map<std::string, Cost> bare;
  for (const Body& body : bodies) {
    if (body.effect == "none") bare[body.model] = body.cost;
  }
  const auto number = [](double instructions) {
    std::ostringstream one;
    one << std::setprecision(3) << instructions / 1000 << " k";
    return one.str();
  };
  for (const auto& [model, cost] : bare) {
    if (model == "neo-hookean") continue;  // the number of Newton iterations depends on the shape
    text << "\n| " << model << " | " << number(cost.instructions) << ", " << cost.bytes << " B |";
    for (const std::string effect :
         {"gravity", "inertia", "damping", "viscosity", "friction", "cutting", "stiffening", "plasticity"}) {
      for (const Body& body : bodies) {
        if (body.model != model || body.effect != effect) continue;
        text << ' ' << number(body.cost.instructions - cost.instructions) << ", " << body.cost.bytes - cost.bytes
             << " B";
      }
      text << " |";
    }
  }
  return text.str();
}

using EffectsProof = tendon::testing::InstructionTest;

TEST_F(EffectsProof, WhatIsNotListedCostsNoInstructionAndNoByte) {
  Counted with(TENDON_PROOF_WHOLE, "none");
  Counted without(TENDON_PROOF_BARE, "none");
  const std::vector<Body>& whole = with.bodies();
  const std::vector<Body>& bare = without.bodies();
  ASSERT_EQ(whole.size(), bare.size());
  for (int run = 1; run < kRuns && !std::ranges::equal(whole, bare, cost_the_same); ++run) {
    with.again();
    without.again();
  }
  ASSERT_GE(bare.size(), 5U);
  for (std::size_t i = 0; i < bare.size(); ++i) {
    ASSERT_EQ(whole[i].model, bare[i].model);
    EXPECT_GT(bare[i].cost.instructions, 1000) << bare[i].model;
    EXPECT_TRUE(cost_the_same(whole[i], bare[i]))
        << bare[i].model << ' ' << whole[i].cost.instructions << ' ' << bare[i].cost.instructions;
    EXPECT_EQ(whole[i].cost.heap, bare[i].cost.heap) << bare[i].model;
    EXPECT_EQ(whole[i].cost.bytes, bare[i].cost.bytes) << bare[i].model;
  }
}

/// Effects too cheap to measure are skipped: the shape changes the work of Newton's method by 0.01 %, and the heap
/// address the cost of a copy by about a hundred instructions.
std::string free_of_charge(const std::vector<Body>& bodies) {
  std::string found;
  std::map<std::string, Cost> none;
  for (const Body& body : bodies) {
    if (body.effect == "none") none[body.model] = body.cost;
    const bool little = body.effect == "friction" || body.effect == "cutting" || body.effect == "stiffening";
    if (body.effect == "none" || body.model == "neo-hookean" || (little && body.model != "condensed")) continue;
    if (body.cost.instructions <= none.at(body.model).instructions) found += body.model + ' ' + body.effect + '\n';
  }
  return found;
}

TEST_F(EffectsProof, WhatIsListedCostsSome) {
  Counted each(TENDON_PROOF_WHOLE, "each");
  const std::vector<Body>& bodies = each.bodies();
  for (int run = 1; run < kRuns && !free_of_charge(bodies).empty(); ++run) each.again();
  EXPECT_EQ(free_of_charge(bodies), "");
  std::map<std::string, Cost> none;
  std::size_t listed = 0;
  for (const Body& body : bodies) {
    if (body.effect == "none") none[body.model] = body.cost;
    if (body.effect == "none") continue;
    ++listed;
    EXPECT_GE(body.cost.bytes, none.at(body.model).bytes) << body.model << ' ' << body.effect;
  }
  EXPECT_EQ(listed, 8U + 2 + 8);
  std::cout << table(bodies) << '\n';
}

}  // namespace
}  // namespace tendon::softbody::effects_proof_test
