// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/file_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/softbody/body.h"
#include "clients/softbody/explain.h"
#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/scene.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::file_mesh_test {
namespace {

struct At {
  int i, j, k;
};

/// 100 × 100 × 50 mm, 8 × 8 × 4 elements, format 2.2 of gmsh.
struct BlockFile {
  std::function<int(At)> times = [](At) { return 1; };
  std::function<int(At)> side = [](At) { return 0; };      ///< elements with different values share no nodes
  std::function<double(At)> shift = [](At) { return 0; };  ///< along x, mm
  std::vector<std::array<int, 8>> orders{{0, 1, 2, 3, 4, 5, 6, 7}};

  std::string text() const {
    std::ostringstream nodes;
    std::map<std::array<int, 4>, int> number;
    const auto node = [&](At cell, std::array<int, 3> corner) {
      const int x = cell.i + corner[0];
      const int y = cell.j + corner[1];
      const int z = cell.k + corner[2];
      const auto [found, is_new] = number.try_emplace({x, y, z, side(cell)}, static_cast<int>(number.size()) + 1);
      if (is_new) {
        nodes << found->second << ' ' << -50 + 12.5 * x + shift(cell) << ' ' << -50 + 12.5 * y << ' ' << 12.5 * z
              << '\n';
      }
      return found->second;
    };
    constexpr std::array<std::array<int, 3>, 8> kCorners{
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
    std::ostringstream elements;
    int count = 0;
    for (int k = 0; k < 4; ++k) {
      for (int j = 0; j < 8; ++j) {
        for (int i = 0; i < 8; ++i) {
          for (int time = 0; time < times({i, j, k}); ++time) {
            elements << ++count << " 5 2 1 1";
            for (const int corner : orders[static_cast<std::size_t>(time) % orders.size()]) {
              elements << ' ' << node({i, j, k}, kCorners[static_cast<std::size_t>(corner)]);
            }
            elements << '\n';
          }
        }
      }
    }
    return "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(number.size()) + "\n" + nodes.str() +
           "$EndNodes\n$Elements\n" + std::to_string(count) + "\n" + elements.str() + "$EndElements\n";
  }
};

class MeshOfAFile : public ::testing::Test {
 protected:
  BodyConfig body_of(const std::string& text, bool slits = false) const {
    const auto file = scratch_.path() / "block.msh";
    std::ofstream(file) << text;
    BodyConfig config;
    config.shape = FileShape{file, 1e-3, slits};
    config.element = Element::kHex8Sri;
    config.material = {.young = 1e4, .poisson = 0.45};
    config.model = LinearConfig{};
    config.patch_radius = 0.02;
    return config;
  }
  static double stiffness(const BodyConfig& body) { return Body(body).settle(Prescribed::kForce, 4e-3).stiffness; }
  static std::string refusal(const BodyConfig& body) {
    try {
      Body made(body);
    } catch (const std::invalid_argument& error) {
      const std::string what = error.what();
      return what.substr(what.find("block.msh"));
    }
    return "";
  }
  static std::string said_of(const BodyConfig& body) {
    std::string all;
    for (const std::string& warning : warnings(body)) all += warning.substr(warning.find("block.msh")) + "\n";
    return all;
  }

 private:
  tendon::testing::ScratchFolder scratch_;
};

constexpr double kWhole = 457.894;   // N/m
constexpr double kHalves = 327.746;  // N/m, two separate halves

TEST_F(MeshOfAFile, AWholeBlockIsAsItIsAndNothingIsSaid) {
  const BodyConfig body = body_of(BlockFile().text());
  EXPECT_NEAR(stiffness(body), kWhole, 1e-3);
  EXPECT_EQ(said_of(body), "");
}

TEST_F(MeshOfAFile, ElementsThatAreThereTwiceCountOnce) {
  BlockFile file;
  file.times = [](At at) { return at.k < 2 ? 2 : 1; };
  const BodyConfig twice = body_of(file.text());
  EXPECT_NEAR(stiffness(twice), kWhole, 1e-3);
  EXPECT_EQ(said_of(twice),
            "block.msh: 128 elements are duplicated and ignored: element 2 has the nodes of element 1\n");
  file.orders = {{0, 1, 2, 3, 4, 5, 6, 7}, {2, 3, 0, 1, 6, 7, 4, 5}};
  EXPECT_NEAR(stiffness(body_of(file.text())), kWhole, 1e-3) << "with nodes in another order";
  file = {.times = [](At at) { return at.i == 3 && at.j == 4 && at.k == 1 ? 3 : 1; }};
  EXPECT_EQ(said_of(body_of(file.text())),
            "block.msh: 2 elements are duplicated and ignored: element 101 has the nodes of element 100\n");
}

TEST_F(MeshOfAFile, NodesAtOnePlaceBecomeOneUnlessTheSceneSaysThatThereIsASlit) {
  BlockFile file;
  file.side = [](At at) { return at.i < 4 ? 0 : 1; };
  const BodyConfig merged = body_of(file.text());
  EXPECT_NEAR(stiffness(merged), kWhole, 1e-3);
  EXPECT_EQ(said_of(merged),
            "block.msh: 45 places had two nodes, which are merged, the first at (0, -50, 0); use slits = true in "
            "[body] to keep them separate\n");
  const BodyConfig apart = body_of(file.text(), true);
  EXPECT_NEAR(stiffness(apart), kHalves, 1e-3);
  EXPECT_EQ(said_of(apart),
            "block.msh: 45 places have two nodes, which are not merged, the first at (0, -50, 0)\n"
            "block.msh: the mesh has 2 parts without a common face; the smallest, of 128 elements, starts with element "
            "1 at (-43.75, -43.75, 6.25)\n");
  file.side = [](At at) { return 64 * at.k + 8 * at.j + at.i; };
  EXPECT_NEAR(stiffness(body_of(file.text())), kWhole, 1e-3);
  EXPECT_PRED2(says, said_of(body_of(file.text())), "397 places had two nodes or more, which are merged")
      << "all but the corners";
}

TEST_F(MeshOfAFile, ExplainAndItsJsonSayWhatWasRepaired) {
  BlockFile file;
  file.side = [](At at) { return at.i < 4 ? 0 : 1; };
  const Scene scene{.body = body_of(file.text())};
  const Explanation explanation = explain(scene, [] { return 0.0; });
  EXPECT_NEAR(explanation.stiffness, kWhole, 1e-3);
  const std::string text = in_words(scene, explanation);
  EXPECT_PRED2(says, text, "/block.msh: 45 places had two nodes, which are merged");
  const auto json = nlohmann::json::parse(in_json(scene, explanation));
  ASSERT_EQ(json["warnings"].size(), 1U);
  EXPECT_PRED2(says, text, "warning: " + json["warnings"][0].get<std::string>());
}

TEST_F(MeshOfAFile, RoundingOfItsDigitsDoesNotKeepNodesApart) {
  BlockFile file;
  file.side = [](At at) { return at.i < 4 ? 0 : 1; };
  file.shift = [](At at) { return at.i < 4 ? 0 : 5e-5; };  // mm, the last of six digits
  EXPECT_NEAR(stiffness(body_of(file.text())), kWhole, 2e-3);
}

TEST_F(MeshOfAFile, EverythingTwiceIsTheWhole) {
  BlockFile file;
  int time = 0;
  file.times = [](At) { return 2; };
  file.side = [&time](At) { return time++ / 8 % 2; };
  const BodyConfig body = body_of(file.text());
  EXPECT_NEAR(stiffness(body), kWhole, 1e-3);
  EXPECT_PRED2(says, said_of(body), "256 elements are duplicated");
  EXPECT_PRED2(says, said_of(body), "405 places had two nodes");
}

TEST_F(MeshOfAFile, APartThatNothingHoldsIsRefusedByItsElementAndPlace) {
  BlockFile file;
  const auto loose = [](At at) { return at.i == 7 && at.j == 7 && at.k == 3; };
  file.side = [&](At at) { return loose(at) ? 1 : 0; };
  file.shift = [&](At at) { return loose(at) ? 10 : 0; };
  EXPECT_EQ(
      refusal(body_of(file.text())),
      "block.msh: there are no fixed nodes in the part of 1 element that starts with element 256 at (53.75, 43.75, "
      "43.75) mm: it has no common face with the other elements. Connect it, fix it (clamped_below_mm), or remove it");
  file.side = [](At at) { return at.k < 2 ? 0 : 1; };
  file.shift = [](At at) { return at.k < 2 ? 0 : 1; };
  EXPECT_PRED2(says, refusal(body_of(file.text())),
               "there are no fixed nodes in the part of 128 elements that starts with element 129");
  file.times = [](At at) { return at.k < 3 || (at.i == 7 && at.j == 7) ? 1 : 0; };
  file.side = [](At) { return 0; };
  file.shift = [](At) { return 0; };
  EXPECT_EQ(refusal(body_of(file.text())), "") << "on a face it is held";
  file.times = [](At at) { return at.k < 3 ? (at.i < 7 ? 1 : 0) : (at.i == 7 && at.j == 7 ? 1 : 0); };
  EXPECT_PRED2(says, refusal(body_of(file.text())),
               "there are no fixed nodes in the part of 1 element that starts with element 169");
}

TEST_F(MeshOfAFile, PartsThatAreHeldByThemselvesAreSaid) {
  BlockFile file;
  file.side = [](At at) { return at.i < 6 ? 0 : 1; };
  file.shift = [](At at) { return at.i < 6 ? 0 : 5; };
  const BodyConfig body = body_of(file.text());
  EXPECT_EQ(refusal(body), "");
  EXPECT_EQ(said_of(body),
            "block.msh: the mesh has 2 parts without a common face; the smallest, of 64 elements, starts with element "
            "7 at (36.25, -43.75, 6.25)\n");
}

std::string refusal_of(const std::string& nodes, int count, const std::string& elements, int of_them) {
  return thrown_by([&] {
    parse_gmsh("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(count) + "\n" + nodes +
                   "$EndNodes\n$Elements\n" + std::to_string(of_them) + "\n" + elements + "$EndElements\n",
               "a.msh", 1);
  });
}

TEST(FileMesh, ElementsThatOverlapAreRefused) {
  const std::string nodes = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0 0 -1\n6 0.2 0.2 2\n";
  EXPECT_EQ(refusal_of(nodes, 6, "7 4 0 1 2 3 4\n8 4 0 1 3 2 5\n", 2), "");
  EXPECT_EQ(refusal_of(nodes, 6, "7 4 0 1 2 3 4\n8 4 0 1 2 3 6\n", 2),
            "a.msh: element 7 and element 8 at (0.3, 0.3, 0.5) overlap: they are on the same side of a shared face");
  EXPECT_EQ(refusal_of(nodes, 6, "7 4 0 1 2 3 4\n8 4 0 1 3 2 5\n9 4 0 1 2 3 6\n", 3),
            "a.msh: element 7 and element 9 at (0.3, 0.3, 0.5) overlap: more than two elements share a face");
}

TEST(FileMesh, AnElementWithTwoNodesAtOnePlaceIsRefused) {
  const std::string nodes =
      "1 0 0 0\n2 1 0 0\n3 1 1 0\n4 1 1 0\n5 0 0 1\n6 1 0 1\n7 1 1 1\n8 1 1 1\n";  // a collapsed hexahedron
  EXPECT_EQ(refusal_of(nodes, 8, "4 5 0 1 2 3 4 5 6 7 8\n", 1), "a.msh: element 4 has two nodes at (1, 1, 0)");
}

TEST(FileMesh, FacesOfEveryShapeLookAtEachOther) {
  for (const Shape shape : {Shape::kTet4, Shape::kHex8, Shape::kHex20, Shape::kHex27}) {
    FileMesh file{.mesh = block(shape, Vec3(3, 2, 2), {3, 2, 2})};
    for (int e = 1; e <= file.mesh.element_count(); ++e) file.numbers.push_back(e);
    const FileMesh made = joined(file, false, "block");
    EXPECT_EQ(made.notes, std::vector<std::string>{});
    EXPECT_EQ(made.mesh.elements, file.mesh.elements);
    EXPECT_EQ(std::ranges::max(made.parts), 0);
  }
}

TEST(Gmsh, SkipsTheMarkOfUtf8AndRefusesUtf16AndASecondMesh) {
  const std::string text = BlockFile().text();
  EXPECT_EQ(parse_gmsh("\xEF\xBB\xBF" + text, "a.msh", 1).mesh.element_count(), 256);
  const auto refusal = [](const std::string& bad) { return thrown_by([&] { parse_gmsh(bad, "a.msh", 1); }); };
  EXPECT_EQ(refusal("\xFF\xFE$"), "a.msh: is UTF-16; save it as UTF-8");
  EXPECT_PRED2(says, refusal(text + text), ": a second $Nodes: expected one mesh in a file");
}

}  // namespace
}  // namespace tendon::softbody::file_mesh_test
