// SPDX-License-Identifier: Apache-2.0
// Cylinders compressed between two plates ($TENDON_DATA, silicone-tissue-phantoms: Dawood et al. 2026, CC BY 4.0), and
// the constitutive laws published with them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/quasi_static.h"

namespace tendon::softbody::silicone_test {
namespace {

constexpr double kRadius = 0.025;  // m
constexpr double kHeight = 0.03;   // m
constexpr double kArea = std::numbers::pi * kRadius * kRadius;
constexpr std::array kCompressions{0.002, 0.01};  // m

/// Force at a compression in m, interpolated between samples, N.
double measured(const std::filesystem::path& file, double compression) {
  std::ifstream in(file);
  std::string line;
  for (int i = 0; i < 8; ++i) std::getline(in, line);  // the description and the column names
  double mm_before = 0;
  double load_before = 0;
  while (std::getline(in, line)) {
    double time = 0;
    double mm = 0;
    double load = 0;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf", &time, &mm, &load) != 3) break;
    if (mm >= 1e3 * compression) {
      return load_before + (load - load_before) * (1e3 * compression - mm_before) / (mm - mm_before);
    }
    mm_before = mm;
    load_before = load;
  }
  ADD_FAILURE() << file << " does not go as far as " << compression << " m";
  return 0;
}

/// An incompressible cylinder that can widen: F = −2 A (λ − λ⁻²) Σ i Cᵢ (I₁ − 3)ⁱ⁻¹, Cᵢ in kPa. With one constant it is
/// the neo-Hookean law with µ = 2 C₁.
double yeoh(const std::vector<double>& constants, double compression) {
  const double stretch = 1 - compression / kHeight;
  const double invariant = stretch * stretch + 2 / stretch - 3;
  double slope = 0;
  for (std::size_t i = 0; i < constants.size(); ++i) {
    slope += static_cast<double>(i + 1) * 1e3 * constants[i] * std::pow(invariant, static_cast<double>(i));
  }
  return -2 * kArea * (stretch - 1 / (stretch * stretch)) * slope;
}

/// N, neo-Hookean. It can slide on oiled plates and sticks to dry ones.
double pressed_cylinder(double mu, double compression, bool oiled) {
  constexpr double kPoisson = 0.4995;  // silicone
  const Material material{.young = 2 * (1 + kPoisson) * mu, .poisson = kPoisson};
  Mesh mesh = cylinder(Shape::kHex8, kRadius, kHeight, 4, oiled ? 2 : 6);
  // the polygonal cross section is smaller than the circle
  const double round = kArea * kHeight / check(mesh, "cylinder");
  Fixed fixed(3 * mesh.nodes.size(), false);
  std::vector<std::size_t> top;
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    const Vec3& node = mesh.nodes[i];
    const bool above = node.z() > kHeight - 1e-9;
    const bool plate = above || node.z() < 1e-9;
    if (above) top.push_back(i);
    const bool on_axis = std::hypot(node.x(), node.y()) < 1e-9;
    fixed[3 * i] = plate && (!oiled || on_axis);
    fixed[3 * i + 1] = plate && (!oiled || on_axis || std::abs(node.y()) < 1e-9);  // no rotation about the axis
    fixed[3 * i + 2] = plate;
  }
  const Solid solid(std::move(mesh), Element::kHex8Sri, material, Law::kNeoHookean, fixed);
  const TouchSurface side(solid.mesh(), Vec3::UnitZ(), kRadius / 2);
  QuasiStaticModel model(solid, side, {});
  constexpr int kSteps = 5;
  for (int step = 1; step <= kSteps; ++step) {
    VectorXd u = model.displacements();
    for (const std::size_t node : top) u[3 * static_cast<Eigen::Index>(node) + 2] = -compression * step / kSteps;
    model.set_displacements(u);
    model.release();
  }
  EXPECT_EQ(solid.inverted(model.displacements()), 0);
  const VectorXd force = solid.forces(model.displacements()).force;
  double sum = 0;
  for (const std::size_t node : top) sum -= force[3 * static_cast<Eigen::Index>(node) + 2];
  return round * sum;
}

TEST(Silicone, ACylinderBetweenOiledPlatesFollowsTheClosedForm) {
  for (const double compression : kCompressions) {
    EXPECT_NEAR(pressed_cylinder(22e3, compression, true) / yeoh({11}, compression), 1, 2e-3) << compression;
  }
}

TEST(Silicone, DryPlatesThatHoldItMakeItStiffer) {
  EXPECT_GT(pressed_cylinder(22e3, 0.002, false), 1.15 * pressed_cylinder(22e3, 0.002, true));
}

/// Yeoh's constants fit the whole curve up to 66 % compression: within the scatter of two specimens (2 %) at 10 mm, but
/// 10 % too soft at 2 mm, because the published fit of stresses gives little weight to small strains. One neo-Hookean
/// constant is too stiff up to 10 mm, because silicone stiffens beyond. So the 10 to 60 % error of the engine is due to
/// this law with its published constant, not to the mesh.
TEST(Silicone, MeasuredCylindersAreThePublishedYeohLawAndNotTheNeoHookeanOne) {
  const char* const data = std::getenv("TENDON_DATA");  // NOLINT(concurrency-mt-unsafe): one thread
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: the measured cylinders are not part of this repository";
  const std::filesystem::path folder = std::filesystem::path(data) / "silicone-tissue-phantoms";
  std::ifstream in(folder / "hyperelastic_parameters.json");
  const nlohmann::json published = nlohmann::json::parse(in).at("engineering");
  const auto constants = [&](const std::string& silicone, const char* law) {
    return published.at(silicone).at(law).at("parameters").get<std::vector<double>>();
  };

  const double scatter = measured(folder / "EF10_0T_A1.csv", 0.002) / measured(folder / "EF10_0T_B2.csv", 0.002) - 1;
  EXPECT_NEAR(scatter, 0.038, 0.005);
  for (const std::string silicone : {"EF10_0T", "EF30_0T", "EF10_50T"}) {
    const auto file = folder / (silicone + "_A1.csv");
    const std::vector<double> three = constants(silicone, "Yeoh_o3");
    EXPECT_NEAR(yeoh(three, 0.01) / measured(file, 0.01), 1, 0.02) << silicone;
    EXPECT_NEAR(yeoh(three, 0.002) / measured(file, 0.002), 0.885, 0.03) << silicone;
    const double mu = 1e3 * constants(silicone, "Neo Hookean").at(0);
    for (const double compression : kCompressions) {
      const double ratio = pressed_cylinder(mu, compression, true) / measured(file, compression);
      EXPECT_GT(ratio, 1.1) << silicone << " at " << compression;
      EXPECT_LT(ratio, 1.6) << silicone << " at " << compression;
      EXPECT_NEAR(ratio * measured(file, compression) / yeoh({0.5e-3 * mu}, compression), 1, 2e-3);
    }
  }
}

}  // namespace
}  // namespace tendon::softbody::silicone_test
