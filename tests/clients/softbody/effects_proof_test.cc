// SPDX-License-Identifier: Apache-2.0
//
// What a scene does not list costs nothing: instructions for each step, by callgrind, of a body without effects in the
// whole program, against a program that was built without them (CMakeLists.txt says how).
#include <gtest/gtest.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace tendon::softbody {
namespace {

constexpr int kSteps = 6 - 2;  // between the two run lengths of softbody-proof

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

/// In a folder of its own, which is gone when this is.
class Folder {
 public:
  Folder() {
    std::string name = std::filesystem::temp_directory_path() / "tendon-proof-XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// The instructions of one file of callgrind's.
double total(const std::filesystem::path& file) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with("totals: ") || line.starts_with("summary: ")) return std::stod(line.substr(line.find(' ')));
  }
  ADD_FAILURE() << file << " has no total";
  return 0;
}

std::vector<Body> count(const std::string& program, const std::string& which) {
  const Folder folder;
  const std::string out = folder.path() / "count";
  const std::string command = "cd " + folder.path().string() +
                              " && OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 valgrind -q --tool=callgrind "
                              "--toggle-collect=touch_in_turn --dump-after=touch_in_turn --callgrind-out-file=" +
                              out + " " + program + " " + which + " > bodies";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  std::vector<Body> bodies;
  std::ifstream lines(folder.path() / "bodies");
  for (Body body; lines >> body.model >> body.effect >> body.cost.heap >> body.cost.bytes;) {
    const std::string few = out + "." + std::to_string(2 * bodies.size() + 1);
    const std::string more = out + "." + std::to_string(2 * bodies.size() + 2);
    body.cost.instructions = (total(more) - total(few)) / kSteps;
    bodies.push_back(body);
  }
  return bodies;
}

/// The README's table.
std::string table(const std::vector<Body>& bodies) {
  std::ostringstream text;
  text << "| model | without | gravity | inertia | damping | viscosity | friction |\n|---|---|---|---|---|---|---|";
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
    for (const std::string effect : {"gravity", "inertia", "damping", "viscosity", "friction"}) {
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

class EffectsProof : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v valgrind > /dev/null") != 0) GTEST_SKIP() << "skipped: there is no valgrind";
  }
};

TEST_F(EffectsProof, WhatIsNotListedCostsNoInstructionAndNoByte) {
  const std::vector<Body> whole = count(TENDON_PROOF_WHOLE, "none");
  const std::vector<Body> bare = count(TENDON_PROOF_BARE, "none");
  ASSERT_GE(bare.size(), 11U);
  ASSERT_EQ(whole.size(), bare.size());
  for (std::size_t i = 0; i < bare.size(); ++i) {
    ASSERT_EQ(whole[i].model, bare[i].model);
    EXPECT_GT(bare[i].cost.instructions, 1000) << bare[i].model;
    EXPECT_NEAR(whole[i].cost.instructions / bare[i].cost.instructions, 1, 1e-3) << bare[i].model;
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
    // numbers takes a hundred instructions more or fewer, by where on the heap they are, friction's own are not to be
    // seen.
    if (body.model == "neo-hookean" || (body.effect == "friction" && body.model != "condensed")) continue;
    EXPECT_GT(body.cost.instructions, none.at(body.model).instructions) << body.model << ' ' << body.effect;
  }
  EXPECT_EQ(listed, 5U + 1 + 5 + 3);
  std::cout << table(bodies) << '\n';
}

}  // namespace
}  // namespace tendon::softbody
