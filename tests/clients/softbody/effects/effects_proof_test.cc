// SPDX-License-Identifier: Apache-2.0
//
// What a scene does not list costs nothing: instructions for each step, by callgrind, of a body without effects in the
// whole program, against a program that was built without them (CMakeLists.txt says how).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iomanip>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/callgrind.h"
#include "tests/support/instruction_test.h"

namespace tendon::softbody::effects_proof_test {
namespace {

constexpr int kSteps = 6 - 2;  // between the two run lengths of softbody-proof
/// Copying many numbers takes so many instructions a step more or fewer, by where on the heap they are.
constexpr double kCopies = 200;

struct Cost {
  double instructions = 0;  ///< for each step
  std::int64_t heap = 0;    ///< bytes
  std::int64_t bytes = 0;   ///< that the body says it keeps
};
struct Body {
  std::string model;
  std::string effect;
  Cost cost;
};

/// The least of three runs: within CHOLMOD some hundred instructions are there in one run and not in the next.
std::vector<Body> count(const std::string& program, const std::string& which) {
  std::vector<Body> bodies;
  for (int run = 0; run < 3; ++run) {
    std::size_t next = 0;
    for (const auto& [line, instructions] : testing::count_instructions(program, which, "touch_in_turn")) {
      Body body;
      std::istringstream(line) >> body.model >> body.effect >> body.cost.heap >> body.cost.bytes;
      body.cost.instructions = instructions / kSteps;
      if (next == bodies.size()) bodies.push_back(body);
      double& least = bodies[next++].cost.instructions;
      least = std::min(least, body.cost.instructions);
    }
  }
  return bodies;
}

/// The README's table.
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
    if (model == "neo-hookean") continue;  // how many steps its Newton's method takes is another for another shape
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

using EffectsProof = testing::InstructionTest;

TEST_F(EffectsProof, WhatIsNotListedCostsNoInstructionAndNoByte) {
  const std::vector<Body> whole = count(TENDON_PROOF_WHOLE, "none");
  const std::vector<Body> bare = count(TENDON_PROOF_BARE, "none");
  ASSERT_GE(bare.size(), 11U);
  ASSERT_EQ(whole.size(), bare.size());
  for (std::size_t i = 0; i < bare.size(); ++i) {
    ASSERT_EQ(whole[i].model, bare[i].model);
    EXPECT_GT(bare[i].cost.instructions, 1000) << bare[i].model;
    EXPECT_NEAR(whole[i].cost.instructions, bare[i].cost.instructions, 1e-3 * bare[i].cost.instructions + kCopies)
        << bare[i].model;
    EXPECT_EQ(whole[i].cost.heap, bare[i].cost.heap) << bare[i].model;
    EXPECT_EQ(whole[i].cost.bytes, bare[i].cost.bytes) << bare[i].model;
  }
}

TEST_F(EffectsProof, WhatIsListedCostsSome) {
  const std::vector<Body> bodies = count(TENDON_PROOF_WHOLE, "each");
  std::map<std::string, Cost> none;
  std::size_t listed = 0;
  for (const Body& body : bodies) {
    if (body.effect == "none") none[body.model] = body.cost;
    if (body.effect == "none") continue;
    ++listed;
    EXPECT_GE(body.cost.bytes, none.at(body.model).bytes) << body.model << ' ' << body.effect;
    // The work of Newton's method is another for another shape, by a few in ten thousand; and where copying many
    // numbers takes a hundred instructions more or fewer, by where on the heap they are, those of an effect that does
    // little are not to be seen.
    const bool little = body.effect == "friction" || body.effect == "cutting" || body.effect == "stiffening";
    if (body.model == "neo-hookean" || (little && body.model != "condensed")) continue;
    EXPECT_GT(body.cost.instructions, none.at(body.model).instructions) << body.model << ' ' << body.effect;
  }
  EXPECT_EQ(listed, 8U + 2 + 8 + 3);
  std::cout << table(bodies) << '\n';
}

}  // namespace
}  // namespace tendon::softbody::effects_proof_test
