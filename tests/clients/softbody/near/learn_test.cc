// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/learn.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "tests/clients/softbody/pressed_block.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::learn_test {
namespace {

using testing::kB1PatchRadius;
using testing::pressed_block;

/// Quick to learn: n = 4, and nine places at the center of the grid.
class Learn : public ::testing::Test {
 protected:
  struct Run {
    Learned learned;
    int told = 0;
  };
  Run run(Law law = Law::kNeoHookean, bool answers = true) const {
    const Solid solid = pressed_block(Element::kHex8Sri, 4, 0.45, law);
    const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    Run run;
    run.learned = learn(solid, top, {.shapes = true, .answers = answers, .reach = 0.002, .folder = folder()},
                        [&](std::string_view) { ++run.told; });
    return run;
  }
  std::filesystem::path folder() const { return scratch_.path() / "learned"; }
  std::vector<std::filesystem::path> files() const {
    std::vector<std::filesystem::path> all;
    for (const auto& entry : std::filesystem::directory_iterator(folder())) all.push_back(entry.path());
    std::ranges::sort(all);
    return all;
  }
  static std::string bytes_of(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

 private:
  tendon::testing::ScratchFolder scratch_;
};

TEST_F(Learn, WhatWasKeptIsReadBitForBitAndNothingIsPressedAgain) {
  const Run made = run();
  EXPECT_GT(made.told, 0);
  ASSERT_EQ(files().size(), 2U);
  const Run read = run();
  EXPECT_EQ(read.told, 0);
  EXPECT_TRUE(read.learned.warnings.empty());
  const LearnedShapes& before = *made.learned.shapes;
  const LearnedShapes& after = *read.learned.shapes;
  EXPECT_EQ(after.elements, before.elements);
  EXPECT_EQ(after.weights, before.weights);
  EXPECT_EQ(after.shapes, before.shapes);
  EXPECT_EQ(after.depths, before.depths);
  EXPECT_EQ(after.linear, before.linear);
  EXPECT_EQ(after.knots, before.knots);
  EXPECT_EQ(after.inverses, before.inverses);
  EXPECT_EQ(after.errors, before.errors);
  EXPECT_EQ(read.learned.answers->numbers, made.learned.answers->numbers);
  EXPECT_EQ(read.learned.answers->errors, made.learned.answers->errors);
}

TEST_F(Learn, OnlyWhatIsMissingIsMade) {
  run(Law::kNeoHookean, false);
  ASSERT_EQ(files().size(), 1U);
  const std::string shapes = bytes_of(files()[0]);
  EXPECT_GT(run().told, 0);
  ASSERT_EQ(files().size(), 2U);
  EXPECT_EQ(bytes_of(files()[1]), shapes);
}

TEST_F(Learn, AnotherLawHasFilesOfItsOwn) {
  run();
  const Run other = run(Law::kCorotational);
  EXPECT_GT(other.told, 0);
  EXPECT_TRUE(other.learned.warnings.empty());
  EXPECT_EQ(files().size(), 4U);
}

TEST_F(Learn, ADamagedFileIsNamedAndLeftAsItIsAndItIsLearnedAnew) {
  const Run made = run();
  const std::filesystem::path answers = files()[0];
  const std::string good = bytes_of(answers);
  ASSERT_NE(answers.string().find("answers-"), std::string::npos);
  const auto damage = [&](const std::string& bytes, const std::string& why) {
    std::ofstream(answers, std::ios::binary) << bytes;
    const Run anew = run();
    EXPECT_GT(anew.told, 0) << why;
    ASSERT_EQ(anew.learned.warnings.size(), 1U) << why;
    EXPECT_PRED2(says, anew.learned.warnings[0], answers.string());
    EXPECT_PRED2(says, anew.learned.warnings[0], why);
    EXPECT_EQ(anew.learned.answers->numbers, made.learned.answers->numbers) << why;
    EXPECT_EQ(bytes_of(answers), bytes) << why;
    EXPECT_EQ(files().size(), 2U) << why;
  };
  damage("", "it does not start with the expected header");
  damage(good.substr(0, 12), "it is truncated");
  damage(good.substr(0, good.size() - 9), "checksum");
  std::string flipped = good;
  flipped[100] = static_cast<char>(flipped[100] ^ 1);
  damage(flipped, "checksum");
  std::ofstream(answers, std::ios::binary) << good;
  EXPECT_EQ(run().told, 0);
}

TEST_F(Learn, AFileOfAnotherBodyUnderThisNameIsRefused) {
  run();
  const std::filesystem::path own = files()[0];
  const std::string name = own.filename().string();
  run(Law::kCorotational);
  for (const auto& file : files()) {
    const std::string other = file.filename().string();
    if (other == name || !other.starts_with("answers-")) continue;
    std::filesystem::copy_file(file, own, std::filesystem::copy_options::overwrite_existing);
  }
  const Run anew = run();
  ASSERT_EQ(anew.learned.warnings.size(), 1U);
  EXPECT_PRED2(says, anew.learned.warnings[0], "another body");
}

}  // namespace
}  // namespace tendon::softbody::learn_test
