// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "clients/softbody/body.h"
#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/mesher/volume.h"
#include "clients/softbody/surface/triangles.h"
#include "tests/clients/softbody/touch/surfaces.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::mesher_test {
namespace {

/// A block of 100 × 100 × 50 mm, whose bottom is centered at the origin.
Triangles block_surface() { return testing::moved(testing::box_surface(Vec3(100, 100, 50)), 1, Vec3(0, 0, 25)); }

std::string off_of(const Triangles& surface) {
  std::ostringstream text;
  text << "OFF\n" << surface.points.size() << " " << surface.facets.size() << " 0\n";
  for (const Vec3& point : surface.points) text << point.x() << " " << point.y() << " " << point.z() << "\n";
  for (const auto& facet : surface.facets) text << "3 " << facet[0] << " " << facet[1] << " " << facet[2] << "\n";
  return text.str();
}

std::string binary_stl_of(const Triangles& surface) {
  const tendon::testing::ScratchFolder scratch;
  write_stl(scratch.path() / "a.stl", surface);
  std::ifstream file(scratch.path() / "a.stl", std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Triangles, WhatIsNoFileOfItsKindIsRefusedWithItsPlace) {
  const auto parse = [](const char* ending, const std::string& text) {
    return thrown_by([&] { parse_surface(text, ending, "a" + std::string(ending)); });
  };
  EXPECT_EQ(parse(".ply", "ply"), "a.ply: expected a surface: a file .stl, .obj or .off");
  EXPECT_EQ(parse(".obj", "v 0 0 0\nv 1 0 x\n"), "a.obj: line 2: expected a number, found \"x\"");
  EXPECT_EQ(parse(".obj", "v 0 0 nan\n"), "a.obj: line 1: expected a number, found \"nan\"");
  EXPECT_EQ(parse(".obj", "v 0 0 0\nf 1 2 3\n"), "a.obj: line 2: there is no vertex 2");
  EXPECT_EQ(parse(".obj", "v 0 0 0\nf 1 1\n"), "a.obj: line 2: expected three corners or more");
  EXPECT_EQ(parse(".off", "OFF\n2 1 0\n0 0 0\n"), "a.off: truncated after 1 points of 2");
  EXPECT_EQ(parse(".off", "OFF\n1 1 0\n0 0 0\n3 0 0 1\n"), "a.off: line 4: there is no point 1");
  EXPECT_EQ(parse(".stl", "solid\nvertex 0 0 0\nvertex 1 0 0\nendloop\n"),
            "a.stl: line 4: expected three corners, found 2");
  EXPECT_EQ(parse(".stl", "nothing"),
            "a.stl: expected an STL file: text that starts with \"solid\", or 84 bytes and 50 for each facet");
  EXPECT_EQ(parse(".obj", "v 0 0 0\n"), "a.obj: has no facet");
  std::string bytes = binary_stl_of(block_surface());
  const float infinity = INFINITY;
  std::memcpy(bytes.data() + 84 + 50 + 12, &infinity, sizeof infinity);
  EXPECT_EQ(parse(".stl", bytes), "a.stl: facet 2: a number is not finite");
}

TEST(Triangles, ASurfaceWithoutAnInsideIsRefusedByTheFacet) {
  Triangles open = block_surface();
  open.facets.pop_back();
  EXPECT_PRED2(says, thrown_by([&] { check(open, "a"); }),
               "has an edge without a second facet: the surface is not closed");

  Triangles turned = block_surface();
  std::swap(turned.facets[4][0], turned.facets[4][1]);
  const std::string sentence = thrown_by([&] { check(turned, "a"); });
  EXPECT_PRED2(says, sentence, "turned inside out, or more than two facets share the edge");

  EXPECT_EQ(thrown_by([] { check(testing::turned_inside_out(block_surface()), "a"); }),
            "a: the surface is turned inside out: expected facets anticlockwise, seen from outside");

  const Triangles crossing = testing::together(block_surface(), testing::moved(block_surface(), 1, Vec3(50, 43, 25)));
  const std::string cut = thrown_by([&] { check(crossing, "a"); });
  EXPECT_PRED2(says, cut, " intersect");
  EXPECT_PRED2(says, cut, "facet ");
}

TEST(MeshReport, KnowsACubeARegularTetrahedronAndASkewedCell) {
  const Mesh cube = block(Shape::kHex8, Vec3(1, 1, 1), {1, 1, 1});
  const Triangles surface = testing::box_surface(Vec3(1, 1, 1));
  const MeshReport of_cube = report_on(cube, surface);
  EXPECT_NEAR(of_cube.worst, 1, 1e-12);
  EXPECT_NEAR(of_cube.volume_error, 0, 1e-12);
  EXPECT_NEAR(of_cube.longest_edge, 1, 1e-12);
  EXPECT_TRUE(of_cube.warnings.empty());

  Mesh skewed = cube;
  for (Vec3& node : skewed.nodes) node.x() += 20 * node.z();
  const MeshReport of_skewed = report_on(skewed, surface);
  EXPECT_NEAR(of_skewed.worst, 1 / std::hypot(1, 20), 1e-9);
  ASSERT_EQ(of_skewed.warnings.size(), 1U);
  EXPECT_PRED2(says, of_skewed.warnings[0], "scaled Jacobian");

  Mesh tetrahedron{
      .shape = Shape::kTet4,
      .nodes = {{0, 0, 0}, {1, 0, 0}, {0.5, std::sqrt(3.0) / 2, 0}, {0.5, std::sqrt(3.0) / 6, std::sqrt(2.0 / 3)}},
      .elements = {0, 1, 2, 3}};
  EXPECT_NEAR(report_on(tetrahedron, surface).worst, 1, 1e-9);
}

TEST(MeshReport, SaysWhenTheMeshIsNotAsLargeAsTheSurface) {
  const MeshReport report = report_on(block(Shape::kHex8, Vec3(90, 100, 50), {2, 2, 1}), block_surface());
  EXPECT_NEAR(report.volume_error, -0.1, 1e-12);
  ASSERT_EQ(report.warnings.size(), 1U);
}

bool has_gmsh() { return std::system("gmsh --version > /dev/null 2>&1") == 0; }  // NOLINT(concurrency-mt-unsafe)

class Meshing : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!has_gmsh()) GTEST_SKIP() << "gmsh is not installed (package gmsh)";
  }
  std::string path(const char* name) const { return (scratch_.path() / name).string(); }
  int run(const std::string& arguments) const {
    const std::string command = std::string(TENDON_MESH) + " " + arguments + " > " + path("said") + " 2>&1";
    return WEXITSTATUS(std::system(command.c_str()));  // NOLINT(concurrency-mt-unsafe): one thread
  }
  std::string said() const {
    std::ifstream file(path("said"));
    return {std::istreambuf_iterator<char>(file), {}};
  }
  double stiffness(const std::string& mesh, Element element) const {
    BodyConfig config;
    config.shape = FileShape{mesh, 1e-3};
    config.element = element;
    config.material = {.young = 1e4, .poisson = 0.45};
    config.patch_radius = 0.02;
    config.reach = 0.005;
    config.middle = Vec3(0, 0, 0.05);
    config.clamped_below = 1e-5;
    return condense(config).stiffness;
  }

 private:
  tendon::testing::ScratchFolder scratch_;
};

// Block B1 of clients/softbody/README.md has 420.2 N/m. Cubes of 12.5 mm have an error of 9.5 %, of 6.25 mm 2.5 %.
TEST_F(Meshing, ABlockOfHexahedraIsNearlyAsStiffAsOneOfCubes) {
  std::ofstream(path("block.off")) << off_of(block_surface());
  ASSERT_EQ(run(path("block.off") + " --size 8 --at 0,0,50 --reach 30 --coarsest 2 --json --out " + path("block.msh")),
            0)
      << said();
  const auto report = nlohmann::json::parse(said());
  EXPECT_GT(report["scaled_jacobian"]["worst"].get<double>(), kPoorElement);
  EXPECT_NEAR(report["volume"].get<double>(), 500'000, 1);
  const double hexahedra = stiffness(path("block.msh"), Element::kHex8Sri);
  EXPECT_GT(hexahedra, 420.2);
  EXPECT_LT(hexahedra, 420.2 * 1.09);
  ASSERT_EQ(
      run(path("block.off") + " --size 8 --at 0,0,50 --reach 30 --coarsest 2 --tetrahedra --out " + path("t.msh")), 0)
      << said();
  EXPECT_GT(stiffness(path("t.msh"), Element::kTet4), 420.2 * 1.2) << "which is why hexahedra are made";
}

TEST_F(Meshing, PartsOfASurfaceAreBodiesCavitiesOrRefusedAsByTheToolMesh) {
  const Triangles block = block_surface();
  const Triangles small = testing::moved(block, 0.25, Vec3(0, 0, 20));
  std::ofstream(path("nested.off")) << off_of(testing::together(block, small));
  EXPECT_EQ(run(path("nested.off") + " --size 20 --out " + path("nested.msh")), 1);
  EXPECT_PRED2(says, said(), "nested.off: the closed part of 12 facets that starts with facet 13 at ");
  EXPECT_PRED2(says, said(), "and has the same orientation");
  EXPECT_FALSE(std::filesystem::exists(path("nested.msh")));

  std::ofstream(path("hollow.off")) << off_of(testing::together(block, testing::turned_inside_out(small)));
  ASSERT_EQ(run(path("hollow.off") + " --size 20 --json --out " + path("hollow.msh")), 0) << said();
  auto report = nlohmann::json::parse(said());
  EXPECT_NEAR(report["volume"].get<double>(), 500'000 * (1 - 1 / 64.0), 1);
  EXPECT_PRED2(says, report["warnings"][0].get<std::string>(), "the surface has 1 cavity");

  std::ofstream(path("apart.off")) << off_of(testing::together(block, testing::moved(block, 0.25, Vec3(100, 0, 0))));
  ASSERT_EQ(run(path("apart.off") + " --size 20 --json --out " + path("apart.msh")), 0) << said();
  report = nlohmann::json::parse(said());
  EXPECT_NEAR(report["volume"].get<double>(), 500'000 * (1 + 1 / 64.0), 1);
  EXPECT_PRED2(says, report["warnings"][0].get<std::string>(), "the surface has 2 separate bodies");
  EXPECT_EQ(std::ranges::max(read_gmsh(path("apart.msh"), 1e-3).parts), 1);

  std::ofstream(path("stands.off")) << off_of(testing::together(block, testing::moved(block, 0.25, Vec3(0, 0, 50))));
  EXPECT_EQ(run(path("stands.off") + " --size 20 --out " + path("stands.msh")), 1);
  EXPECT_PRED2(says, said(), "overlap: parts that touch must be one surface");
}

TEST_F(Meshing, ElementsAreSmallWhereTheBodyIsTouchedAndLargeElsewhere) {
  const auto around = [&](const Vec3& touched) {
    std::string words;
    const Mesh mesh = volume_of(block_surface(), {.size = 5, .coarsest = 3, .touched = touched, .reach = 20}, words);
    int near = 0;
    for (const Vec3& node : mesh.nodes) near += (node - Vec3(0, 0, 50)).norm() < 15 ? 1 : 0;
    return near;
  };
  EXPECT_GT(around(Vec3(0, 0, 50)), 3 * around(Vec3(50, 50, 0)));
}

TEST_F(Meshing, NothingThatIsThereIsOverwrittenAndABadSurfaceMakesNothing) {
  std::ofstream(path("kept.msh")) << "mine";
  std::ofstream(path("block.off")) << off_of(block_surface());
  EXPECT_EQ(run(path("block.off") + " --size 10 --out " + path("kept.msh")), 1);
  EXPECT_PRED2(says, said(), "the file exists and is not overwritten");
  Triangles open = block_surface();
  open.facets.pop_back();
  std::ofstream(path("open.off")) << off_of(open);
  EXPECT_EQ(run(path("open.off") + " --size 10 --out " + path("new.msh")), 1);
  EXPECT_PRED2(says, said(), "open.off: facet");
  EXPECT_FALSE(std::filesystem::exists(path("new.msh")));
  EXPECT_EQ(run(path("block.off") + " --size -1 --out " + path("new.msh")), 2);
  EXPECT_EQ(run(path("block.off") + " --size 10 --at 0,0,50 --out " + path("new.msh")), 2) << "how far from there?";
}

/// mm, an ellipsoid of 110 × 58 × 44 with an indentation in its side; roughly a kidney.
Triangles bean_surface() {
  Triangles surface = testing::ball(1, 36);
  for (Vec3& point : surface.points) {
    point.normalize();
    const double x = 55 * point.x();
    const double below = std::max(0.0, -point.y());
    const double hollow = 15 * below * below * std::exp(-x * x / 625) - 9 * x * x / 3025;
    point = Vec3(x, 29 * point.y() + hollow, 22 * point.z());
  }
  return surface;
}

// Moving all nodes fully to the surface gives a quality of −0.2; moving none loses a tenth of the volume.
TEST_F(Meshing, OnACurvedSurfaceNodesGoAsFarAsElementsStayWellShaped) {
  const Triangles bean = bean_surface();
  check(bean, "bean");
  std::string words;
  const VolumeConfig config{.size = 7, .coarsest = 1.5, .touched = Vec3(0, 0, 22), .reach = 25};
  const MeshReport report = report_on(volume_of(bean, config, words), bean);
  EXPECT_GT(report.worst, 0.04);
  EXPECT_GT(report.worst_percent, 0.1);
  EXPECT_GT(report.volume_error, -0.06);
  EXPECT_LT(report.volume_error, 0);
}

TEST_F(Meshing, TheKidneysMeshIsWhatItsSurfaceMakes) {
  const std::string scenes = TENDON_SCENES;
  const std::string surface = path("kidney.off");
  // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread
  ASSERT_EQ(std::system(("python3 " + scenes + "/kidney_surface > " + surface).c_str()), 0);
  ASSERT_EQ(run(surface + " --size 6 --at 0,0,22 --reach 25 --coarsest 1.5 --out " + path("kidney.msh")), 0) << said();
  const Mesh made = read_gmsh(path("kidney.msh"), 1e-3).mesh;
  const Mesh kept = read_gmsh(scenes + "/kidney.msh", 1e-3).mesh;
  // The node positions depend on the version of gmsh.
  EXPECT_NEAR(check(made, "made") / check(kept, "kept"), 1, 0.01);
  EXPECT_NEAR(static_cast<double>(made.nodes.size()) / static_cast<double>(kept.nodes.size()), 1, 0.2);
}

TEST_F(Meshing, TheSameSurfaceGivesTheSameMesh) {
  std::string words;
  const VolumeConfig config{.size = 12};
  EXPECT_EQ(to_gmsh(volume_of(block_surface(), config, words)), to_gmsh(volume_of(block_surface(), config, words)));
}

}  // namespace
}  // namespace tendon::softbody::mesher_test
