// SPDX-License-Identifier: Apache-2.0
#include "core/control/nonlinear_coupling.h"

#include "tests/core/control/adversary.h"

namespace tendon::nonlinear_coupling_test {
namespace {

using std::chrono::milliseconds;

constexpr Friction kFriction{0.05, 0.26};

TEST(NonlinearCoupling, TheLedgerCoversTheSpringAndTheProxysAccount) {
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    Dice dice(seed);
    const double slope = dice.within(50, 520);
    NonlinearCoupling<3> law({kFriction, milliseconds(1), slope});
    Vec3 force = Vec3::Zero();
    double scale = 1;
    for (int step = 0; step < 300; ++step) {
      const Duration held = dice.milliseconds(0.2, 1);
      const Vec3 dx =
          dice.chance(0.3) ? worst_motion<3>(force, {0, 0.26}, held) : Vec3(dice.direction() * dice.decades(-6, -2.5));
      law.observe({force, dx, held});
      force = law.limit({Vec3(dice.direction() * dice.decades(-2, 2))}).force;
      scale += std::abs(force.dot(dx));
      ASSERT_GE(law.account(), -1e-12 * scale);
      ASSERT_GE(law.energy(), force.squaredNorm() / (2 * slope) + law.account() - 1e-12 * scale) << "seed " << seed;
    }
  }
}

// The slope must satisfy K_max ≤ 2b/T: core/PROOFS.md, "Comparison laws".
TEST(NonlinearCoupling, AStaticFieldNoSteeperThanItMayBePassesUnchanged) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    Dice dice(seed);
    NonlinearCoupling<3> law({kFriction, milliseconds(1)});
    World<3> world = static_world<3>(dice, 519, {});
    Vec3 x = Vec3::Zero();
    Vec3 force = Vec3::Zero();
    for (int step = 0; step < 500; ++step) {
      const Vec3 dx = dice.direction() * dice.decades(-6, -2.5);
      law.observe({force, dx, milliseconds(1)});
      x += dx;
      const LimitedForce<3> limited = law.limit(world(x));
      ASSERT_NEAR((limited.force - world(x).force).norm(), 0, 1e-9) << "seed " << seed << " step " << step;
      force = limited.force;
    }
  }
}

TEST(NonlinearCoupling, ASaturatingAndAHardeningSpringAreStaticFieldsToo) {
  const auto saturating = [](double x) { return 3 * std::tanh(519.0 / 3 * x); };
  const auto hardening = [](double x) { return std::copysign(x * x, x) * 519 / (2 * 0.01); };  // slope 519 N/m at 10 mm
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Dice dice(seed);
    for (const bool first : {true, false}) {
      NonlinearCoupling<1> law({kFriction, milliseconds(1)});
      Vec<1> force(0);
      double x = 0;
      for (int step = 0; step < 500; ++step) {
        const double next = dice.within(-0.01, 0.01) * dice.decades(-3, 0);
        law.observe({force, Vec<1>(next - x), milliseconds(1)});
        x = next;
        const double wanted = -(first ? saturating(x) : hardening(x));
        force = law.limit({Vec<1>(wanted)}).force;
        ASSERT_NEAR(force[0], wanted, 1e-9) << "seed " << seed << " step " << step;
      }
    }
  }
}

TEST(NonlinearCoupling, AForceThatComesLateYieldsInsteadOfGivingEnergy) {
  NonlinearCoupling<1> law({kFriction, milliseconds(1)});
  World<1> world = delayed<1>([](const Vec<1>& x) { return Demand<1>{Vec<1>(-500 * x), Mat<1>(500.0)}; }, 50);
  Vec<1> force(0);
  double x = 0;
  bool yielded = false;
  for (int step = 1; step < 2000; ++step) {
    const double next = 5e-3 * std::sin(0.02 * step);
    law.observe({force, Vec<1>(next - x), milliseconds(1)});
    x = next;
    const LimitedForce<1> limited = law.limit(world(Vec<1>(x)));
    force = limited.force;
    yielded = yielded || limited.reasons.has(Reason::kEnergy);
    ASSERT_GE(law.energy(), 0);
  }
  EXPECT_TRUE(yielded);
}

// Each return yields an excess of (K/2 − b/T) Δx².
double energy_of_shaking(double overclaim) {
  NonlinearCoupling<1> law({{0, 0.26 * overclaim}, milliseconds(1)});
  EnergyLedger truth({0, 0.26});
  Vec<1> force(0);
  for (int step = 0; step < 200; ++step) {
    const double dx = step % 2 == 0 ? 1e-3 : -1e-3;
    truth.observe(force, Vec<1>(dx), milliseconds(1));
    law.observe({force, Vec<1>(dx), milliseconds(1)});
    force = law.limit({Vec<1>(-1e6)}).force;
  }
  return truth.energy();
}

TEST(NonlinearCoupling, ASlopeFivePercentTooHighGivesOutEnergy) {
  EXPECT_GE(energy_of_shaking(1.0), -1e-12);
  EXPECT_LT(energy_of_shaking(1.05), -1e-6);
}

}  // namespace
}  // namespace tendon::nonlinear_coupling_test
