// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/mesh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>
#include <stdexcept>
#include <string>

#include "clients/softbody/fem/gmsh.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::mesh_test {
namespace {

constexpr Shape kShapes[] = {Shape::kTet4, Shape::kHex8, Shape::kHex20, Shape::kHex27};

TEST(Elements, EachShapeFunctionIsOneAtItsNodeAndZeroAtTheOthers) {
  for (const Shape shape : kShapes) {
    for (int node = 0; node < nodes_of(shape); ++node) {
      const ShapeValues values = shape_at(shape, node_at(shape, node));
      for (int other = 0; other < nodes_of(shape); ++other) {
        EXPECT_NEAR(values.value[other], other == node ? 1 : 0, 1e-14) << nodes_of(shape) << ' ' << node;
      }
    }
  }
}

TEST(Elements, GradientsAreThoseOfTheValues) {
  const Vec3 here(0.21, 0.34, 0.17);
  for (const Shape shape : kShapes) {
    const ShapeValues values = shape_at(shape, here);
    EXPECT_NEAR(values.value.sum(), 1, 1e-14);
    EXPECT_LT(values.gradient.rowwise().sum().norm(), 1e-13);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 step = 1e-6 * Vec3::Unit(axis);
      const Eigen::VectorXd change = (shape_at(shape, here + step).value - shape_at(shape, here - step).value) / 2e-6;
      EXPECT_LT((change.transpose() - values.gradient.row(axis)).norm(), 1e-9);
    }
  }
}

TEST(Elements, EveryPartOfTheMaterialIsIntegratedOverTheWholeVolume) {
  for (const ElementInfo& each : elements()) {
    double mu = 0;
    double lambda = 0;
    for (const QuadraturePoint& point : quadrature(each.element)) {
      mu += point.mu * point.weight;
      lambda += point.lambda * point.weight;
    }
    const double volume = each.shape == Shape::kTet4 ? 1 / 6.0 : 8;
    EXPECT_NEAR(mu, volume, 1e-14) << each.name;
    EXPECT_NEAR(lambda, volume, 1e-14) << each.name;
    EXPECT_EQ(element_named(each.name), each.element);
  }
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const Facet& facet : surface(mesh)) {
    const Face& face = faces(mesh.shape)[static_cast<std::size_t>(facet.face)];
    const bool triangle = mesh.shape == Shape::kTet4;
    const Vec3 middle = triangle ? Vec3(face.origin + (face.along_s + face.along_t) / 3) : face.origin;
    const ShapeValues shape = shape_at(mesh.shape, middle);
    Mat3 jacobian = Mat3::Zero();
    for (int i = 0; i < nodes_of(mesh.shape); ++i) {
      const int node = mesh.element(facet.element)[static_cast<std::size_t>(i)];
      jacobian += mesh.nodes[static_cast<std::size_t>(node)] * shape.gradient.col(i).transpose();
    }
    sum += (triangle ? 0.5 : 4) * (jacobian * face.along_s).cross(jacobian * face.along_t).norm();
  }
  return sum;
}

TEST(Meshes, BlocksOfEveryShapeFillTheirVolumeAndAreClosed) {
  for (const Shape shape : kShapes) {
    const Mesh mesh = block(shape, Vec3(0.1, 0.08, 0.05), {4, 3, 2});
    EXPECT_NEAR(check(mesh, "block"), 4e-4, 1e-15);
    EXPECT_NEAR(area(mesh), 2 * (0.1 * 0.08 + 0.1 * 0.05 + 0.08 * 0.05), 1e-15);  // an open seam would increase this
  }
  EXPECT_EQ(block(Shape::kTet4, Vec3(0.1, 0.1, 0.05), {8, 8, 4}).element_count(), 1536);
}

TEST(Meshes, CylindersApproachTheirVolumeFromBelowWithMoreCells) {
  const double exact = std::numbers::pi * 0.025 * 0.025 * 0.03;
  for (const Shape shape : {Shape::kTet4, Shape::kHex8, Shape::kHex27}) {
    const double coarse = exact - check(cylinder(shape, 0.025, 0.03, 4, 3), "cylinder");
    const double fine = exact - check(cylinder(shape, 0.025, 0.03, 8, 3), "cylinder");
    EXPECT_GT(fine, 0);
    EXPECT_NEAR(coarse / fine, 4, 0.1);
  }
  EXPECT_THROW(cylinder(Shape::kHex8, 0.025, 0.03, 5, 3), std::invalid_argument);
}

TEST(Meshes, AnEvenBlockOfTetrahedraIsItsOwnMirrorImage) {
  const Mesh mesh = block(Shape::kTet4, Vec3(2, 2, 1), {2, 2, 1});
  std::vector<std::array<double, 3>> middles;
  std::vector<std::array<double, 3>> mirrored;
  for (int e = 0; e < mesh.element_count(); ++e) {
    Vec3 sum = Vec3::Zero();
    for (const int node : mesh.element(e)) sum += mesh.nodes[static_cast<std::size_t>(node)];
    middles.push_back({sum.x(), sum.y(), sum.z()});
    mirrored.push_back({-sum.x(), sum.y(), sum.z()});
  }
  std::ranges::sort(middles);
  std::ranges::sort(mirrored);
  EXPECT_EQ(middles, mirrored);
}

std::string refusal(const std::string& text) {
  return thrown_by([&] { parse_gmsh(text, "bad.msh", 1); });
}

const std::string kHead = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
const std::string kFive = "$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 0.3 0.3 0\n$EndNodes\n";

TEST(Gmsh, ReadsWhatTheThreeFormatsSay) {
  const std::string two = kHead + kFive + "$Elements\n2\n7 2 2 0 1 1 2 3\n9 4 2 0 1 1 2 3 4\n$EndElements\n";
  const std::string one = "$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n1\n9 4 1 1 4 1 2 3 4\n$ENDELM\n";
  const std::string four =
      "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 0 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 "
      "1\n$EndNodes\n"
      "$Elements\n1 1 9 9\n3 0 4 1\n9 1 2 3 4\n$EndElements\n";
  for (const std::string& text : {one, two, four}) {
    const Mesh mesh = parse_gmsh(text, "good.msh", 1e-3).mesh;
    EXPECT_EQ(mesh.nodes.size(), 4U);  // the fifth node belongs to no volume element
    EXPECT_EQ(mesh.element_count(), 1);
    EXPECT_NEAR(check(mesh, "good.msh"), 1e-9 / 6, 1e-20);
  }
}

TEST(Gmsh, NamesTheElementThatIsWrong) {
  const auto with = [](const std::string& element) {
    return refusal(kHead + kFive + "$Elements\n2\n7 4 0 1 2 3 4\n" + element + "\n$EndElements\n");
  };
  EXPECT_EQ(with("9 4 0 1 3 2 4"), "bad.msh: element 9 is turned inside out");
  EXPECT_EQ(with("9 4 0 1 2 3 5"), "bad.msh: element 9 has no volume");
  EXPECT_EQ(with("9 4 0 1 2 3 6"), "bad.msh:15: element 9 has the node 6, which does not exist");
  EXPECT_EQ(with("9 4 0 1 2 3 3"), "bad.msh:15: element 9 has a node twice");
  EXPECT_EQ(with("9 11 0 1 2 3 4 5 1 2 3 4 5"),
            "bad.msh:15: element 9: expected a tetrahedron with 4 nodes, or a hexahedron with 8, 20 or 27");
  EXPECT_EQ(with("9 4 0 1 2 3"), "bad.msh:16: expected a whole number, found \"$EndElements\"");
  EXPECT_EQ(with("9 99 0 1 2 3 4"), "bad.msh:15: unknown type of element: 99");
}

TEST(Gmsh, RefusesWhatIsNotAMesh) {
  EXPECT_EQ(refusal(""), "bad.msh:1: expected $MeshFormat or $NOD, found the end of the file");
  EXPECT_NE(refusal("solid stl"), "");
  EXPECT_EQ(refusal("$MeshFormat\n2.2 1 8\n"), "bad.msh:2: expected a text file, found a binary file");
  EXPECT_EQ(refusal("$MeshFormat\n3 0 8\n"), "bad.msh:2: expected format 2.2 or 4.1");
  EXPECT_EQ(refusal(kHead + "$Nodes\n99999999999\n"),
            "bad.msh:5: expected a count of at most 10 million, found 99999999999");
  EXPECT_EQ(refusal(kHead + "$Nodes\n1\n1 nan 0 0\n"), "bad.msh:6: expected a number, found \"nan\"");
  EXPECT_EQ(refusal(kHead + "$Nodes\n2\n1 0 0 0\n1 0 0 1\n"), "bad.msh:7: node 1 occurs twice");
  EXPECT_EQ(refusal(kHead + kFive + "$Elements\n1\n7 2 0 1 2 3\n$EndElements\n"),
            "bad.msh: expected volume elements, found only a surface");
}

}  // namespace
}  // namespace tendon::softbody::mesh_test
