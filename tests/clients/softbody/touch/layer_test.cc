// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/layer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::layer_test {
namespace {

constexpr double kThickness = 2e-4;  // m
constexpr double kYoung = 1e4;       // Pa

/// The whole top of B1, so that every point is equally deep.
struct Covered {
  Covered() : solid(testing::pressed_block(Element::kHex8Sri, 4, 0.45)), layer(solid, config()) {}
  static Layer::Config config() {
    Layer::Config made;
    made.thickness = kThickness;
    made.young = kYoung;
    made.piece = 0.01;
    return made;
  }
  /// Overlap of box and layer, m.
  Layer::Press at(double overlap) const {
    const std::vector<Layer::Placed> placed{{&tool, Pose{.position = Vec3(0, 0, 0.05 + 0.01 + kThickness - overlap)}}};
    const VectorXd rest = VectorXd::Zero(solid.size());
    const Layer::Near near = layer.near(placed, rest, 0);
    return layer.press(near, placed, layer.places(near, rest), Layer::Order::kFelt);
  }

  Solid solid;
  Layer layer;
  HeldTool tool{RigidShape::box(Vec3(0.2, 0.2, 0.02), 0.002)};
};

TEST(Layer, PressesWithYoungsModulusAndBeginsWithoutAStepInForceOrStiffness) {
  const Covered covered;
  constexpr double kArea = 0.01;                          // m²
  constexpr double kOnset = kThickness / 10;              // m
  constexpr double kStiff = kArea * kYoung / kThickness;  // N/m, past the onset
  EXPECT_EQ(covered.at(-1e-9).energy, 0);
  for (const double share : {0.001, 0.25, 0.5, 0.999}) {
    const Layer::Press press = covered.at(share * kOnset);
    EXPECT_NEAR(press.felt[0].curve(2, 2), share * kStiff, 1e-6 * kStiff) << share;
    EXPECT_NEAR(-press.felt[0].slope[2], share * share * kOnset * kStiff / 2, 1e-6 * kOnset * kStiff) << share;
    EXPECT_NEAR(press.energy, share * share * share * kOnset * kOnset * kStiff / 6, 1e-6 * kOnset * kOnset * kStiff);
    EXPECT_NEAR(press.felt[0].area, kArea, 1e-9);
  }
  for (const double overlap : {kOnset, 0.4 * kThickness, kThickness, 2 * kThickness}) {
    const Layer::Press press = covered.at(overlap);
    EXPECT_NEAR(press.felt[0].curve(2, 2), kStiff, 1e-6 * kStiff) << overlap;
    EXPECT_NEAR(-press.felt[0].slope[2], kStiff * (overlap - kOnset / 2), 1e-6 * kStiff * kThickness) << overlap;
    double nodes = 0;
    for (Eigen::Index i = 2; i < press.slope.size(); i += 3) nodes += press.slope[i];
    EXPECT_NEAR(nodes, -press.felt[0].slope[2], 1e-12);
  }
}

/// Compares the layer's energy and forces with a sum over all points of the top, for a ball.
TEST(Layer, PressesEachPointThatAToolTouchesAndNoOther) {
  const Solid solid = testing::pressed_block(Element::kHex8Sri, 4, 0.45);
  constexpr double kFacet = 0.025;  // m
  constexpr double kRadius = 0.003;
  for (const int cuts : {5, 8, 30}) {
    Layer::Config config = Covered::config();
    config.piece = 1.4 * kFacet / std::sqrt(2.0) / (cuts - 0.5);
    const Layer layer(solid, config);
    const HeldTool ball{RigidShape::sphere(kRadius)};
    for (const Vec2& at : {Vec2(0.001, 0.0123), Vec2(0.0101, 0.0042), Vec2(0.0249, 0.0)}) {
      const Vec3 middle(at.x(), at.y(), 0.05 + kRadius - 0.0005);
      const std::vector<Layer::Placed> placed{{&ball, Pose{.position = middle}}};
      const VectorXd rest = VectorXd::Zero(solid.size());
      const Layer::Near near = layer.near(placed, rest, 0.25);
      const double found = layer.press(near, placed, layer.places(near, rest), Layer::Order::kFelt).felt[0].area;
      const double step = kFacet / cuts;
      double expected = 0;
      for (double x = -0.05 + step / 2; x < 0.05; x += step) {
        for (double y = -0.05 + step / 2; y < 0.05; y += step) {
          const double away = (Vec3(x, y, 0.05) - middle).norm() - kRadius;
          if (away < kThickness) expected += step * step;
        }
      }
      EXPECT_NEAR(found, expected, 1e-9 * kFacet * kFacet) << cuts << ' ' << at.transpose();
    }
  }
}

TEST(Layer, RefusesWhatIsNoLayer) {
  const Solid solid = testing::pressed_block(Element::kHex8Sri, 2, 0.3);
  const auto refused = [&](auto change) {
    Layer::Config config = Covered::config();
    change(config);
    EXPECT_THROW(Layer(solid, config), std::invalid_argument);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double bad : {0.0, -1.0, nan}) {
    refused([&](Layer::Config& config) { config.thickness = bad; });
    refused([&](Layer::Config& config) { config.young = bad; });
    refused([&](Layer::Config& config) { config.piece = bad; });
    refused([&](Layer::Config& config) {
      config.friction = 0.5;
      config.shear = bad;
    });
  }
  refused([](Layer::Config& config) { config.friction = -0.1; });
}

}  // namespace
}  // namespace tendon::softbody::layer_test
