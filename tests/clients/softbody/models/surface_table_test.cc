// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/surface_table.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

#include "clients/softbody/body.h"
#include "clients/softbody/scene.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::surface_table_test {
namespace {

using testing::pressed_body;

class SurfaceTableFile : public ::testing::Test {
 protected:
  std::filesystem::path file() const { return scratch_.path() / "block.table"; }
  std::string bytes() const {
    std::ifstream in(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void put(const std::string& bytes) const { std::ofstream(file(), std::ios::binary) << bytes; }
  std::string reading() const {
    return thrown_by([&] { read_table(file()); });
  }
  static BodyConfig block(int n) {
    BodyConfig config = pressed_body(ModelKind::kCondensed, Element::kHex8Sri, n);
    config.reach = 0.01;
    return config;
  }
  BodyConfig from_file(int n) const {
    BodyConfig config = block(n);
    config.model = CondensedConfig{.table_file = file()};
    return config;
  }

 private:
  tendon::testing::ScratchFolder scratch_;
};

TEST_F(SurfaceTableFile, ABodyFromItAnswersBitForBitAsTheOneThatMakesItsTable) {
  write_table(file(), condense(block(8)));
  Body made(block(8));
  Body read(from_file(8));
  for (const Vec3& off : {Vec3(0, 0, -0.001), Vec3(0.004, -0.003, -0.002), Vec3(-0.009, 0.001, -0.004)}) {
    const Vec3 tool = made.touch_point() + off;
    const Feel expected = made.touch(tool);
    const Feel felt = read.touch(tool);
    EXPECT_EQ(felt.force, expected.force);
    EXPECT_EQ(felt.stiffness, expected.stiffness);
    EXPECT_GT(felt.force.z(), 0.1);
  }
  EXPECT_EQ(read.linear_up_to(), made.linear_up_to());
}

TEST_F(SurfaceTableFile, ComesBackBitForBitAndMayBeMadeAnew) {
  const SurfaceTable table = condense(block(4));
  write_table(file(), table);
  write_table(file(), table);
  const SurfaceTable read = read_table(file());
  EXPECT_EQ(read.compliance, table.compliance);
  EXPECT_EQ(read.nodes, table.nodes);
  EXPECT_EQ(read.stiffness, table.stiffness);
  put("a letter to a friend\n");
  EXPECT_THROW(write_table(file(), table), std::runtime_error);
  EXPECT_EQ(bytes(), "a letter to a friend\n");
}

TEST_F(SurfaceTableFile, LeavesNoDraftIfTheDiskIsFull) {
  const SurfaceTable table = condense(block(4));
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 100;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(write_table(file(), table), std::runtime_error);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_TRUE(std::filesystem::is_empty(file().parent_path()));
}

TEST_F(SurfaceTableFile, OfAnotherBodyIsRefused) {
  write_table(file(), condense(block(8)));
  EXPECT_PRED2(says, thrown_by([&] { Body{from_file(4)}; }), "is the table of another body");
  expect_refusals(
      from_file(8), Makes<Body>(),
      {
          {"is the table of another body",
           [](auto& c) {
             c.regions = {{.where = Region::Ball{.middle = Vec3(0, 0, 0.03), .radius = 0.02}, .material = {1e5, 0.4}}};
           }},
          {"is the table of another body", [](auto& c) { c.material.young *= 1.0000001; }},
          {"does not cover reach_mm", [](auto& c) { c.reach = 0.03; }},
      });
  BodyConfig nearer = from_file(8);
  nearer.reach = 0.005;
  EXPECT_NO_THROW(Body{nearer}) << "a smaller part of it is there";
}

TEST_F(SurfaceTableFile, ThatHasChangedBreaksOffOrIsNoneIsRefused) {
  EXPECT_PRED2(says, reading(), "no such file");
  write_table(file(), condense(block(4)));
  const std::string whole = bytes();
  for (const std::size_t at : {9U, 20U, 40U, 80U, 200U}) {
    std::string changed = whole;
    changed[at] = static_cast<char>(changed[at] ^ 1);
    put(changed);
    EXPECT_PRED2(says, reading(), "expected a table of a surface") << at;
  }
  put(whole.substr(0, whole.size() - 8));
  EXPECT_PRED2(says, reading(), "bytes, expected");
  put("TENDONST");
  EXPECT_PRED2(says, reading(), "it is truncated");
  put(whole + "1");
  EXPECT_PRED2(says, reading(), "bytes, expected");
}

TEST_F(SurfaceTableFile, ThatWouldGiveOutEnergyOrAnswersOtherwiseIsRefused) {
  SurfaceTable table = condense(block(4));
  SurfaceTable active = table;
  active.compliance(0, 1) = active.compliance(1, 0) = 2 * active.compliance(0, 0);
  write_table(file(), active);
  EXPECT_PRED2(says, reading(), "it is not positive semidefinite");
  SurfaceTable softer = table;
  softer.compliance *= 1.001;
  write_table(file(), softer);
  EXPECT_PRED2(says, thrown_by([&] { Body{from_file(4)}; }), "does not reproduce the answers");
  SurfaceTable infinite = table;
  infinite.compliance(0, 0) = std::numeric_limits<double>::infinity();
  write_table(file(), infinite);
  EXPECT_PRED2(says, reading(), "not finite");
}

TEST_F(SurfaceTableFile, IsForTheModelCondensedAndForPatchesAndSpheres) {
  write_table(file(), condense(block(4)));
  BodyConfig linear = from_file(4);
  linear.model = LinearConfig{};
  EXPECT_EQ(thrown_by([&] { condense(linear); }), "only the model \"condensed\" has a table");
  BodyConfig capsule = from_file(4);
  capsule.tool = CapsuleTool{.radius = 0.02, .half_length = 0};
  EXPECT_EQ(thrown_by([&] { Body{capsule}; }), "a capsule cannot use a table in a file");
  BodyConfig sphere = from_file(4);
  sphere.tool = SphereTool{0.02};
  EXPECT_NO_THROW(Body{sphere});
}

}  // namespace
}  // namespace tendon::softbody::surface_table_test
