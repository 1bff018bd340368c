// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>

#include "core/stability/coulomb_boundary.h"
#include "core/stability/passivity_boundary.h"
#include "core/stability/stability_boundary.h"
#include "tests/support/refusal.h"

namespace tendon::closed_forms_test {
namespace {

using namespace std::chrono_literals;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

SampledSpring paper_device() { return {.mass = 0.075, .viscous = 0.26, .period = 1ms}; }

SampledSpring spring(double stiffness, double damping, int delay) {
  SampledSpring result = paper_device();
  result.stiffness = stiffness;
  result.damping = damping;
  result.delay_samples = delay;
  return result;
}

TEST(ColgateSchenkel, WithoutDelayIsHalfTKPlusTheDamperOfEitherSign) {
  EXPECT_NEAR(passive_viscous_friction(spring(500, 0, 0)), 0.25, 1e-12);
  EXPECT_NEAR(passive_viscous_friction(spring(500, 0.2, 0)), 0.45, 1e-12);
  EXPECT_NEAR(passive_viscous_friction(spring(500, -0.2, 0)), 0.45, 1e-12);
}

TEST(ColgateSchenkel, DelayCostsAWholePeriodOfStiffnessEach) {
  for (int d = 0; d <= 20; ++d) EXPECT_NEAR(passive_viscous_friction(spring(500, 0, d)), 0.5 * (0.5 + d), 1e-9) << d;
}

TEST(ColgateSchenkel, WithDelayADamperMayHelpSpringAndMayHurt) {
  EXPECT_NEAR(passive_viscous_friction(spring(500, 0.2, 1)), 0.60625, 5e-6);  // independent program
  // The bound is at most K(T/2 + dT) + |B|, which is sufficient, and at least the limit for θ → 0.
  for (const double b : {-1.0, -0.2, 0.2, 1.0}) {
    for (int d = 0; d <= 8; ++d) {
      const double k_age = 500 * (0.5 + d) * 1e-3;
      const double demanded = passive_viscous_friction(spring(500, b, d));
      EXPECT_LE(demanded, k_age + std::abs(b) + 1e-12);
      EXPECT_GE(demanded, k_age - b - 1e-12);
    }
  }
}

TEST(ColgateSchenkel, TheGeneralFormAgreesOnTheSpringAndDamper) {
  for (const double b : {-0.2, 0.0, 0.2, 1.0}) {
    for (int d = 0; d <= 5; ++d) {
      const auto environment = [b, d](std::complex<double> z) {
        return std::pow(z, -d) * (500.0 + b * (1.0 - 1.0 / z) / 1e-3);
      };
      EXPECT_NEAR(passive_viscous_friction(environment, 1ms), passive_viscous_friction(spring(500, b, d)), 1e-5)
          << b << " " << d;
    }
  }
}

TEST(ColgateSchenkel, TheLargestStiffnessDemandsJustTheFrictionThatIsThere) {
  for (const double b : {-0.1, 0.0, 0.1, 0.2}) {
    for (int d = 0; d <= 5; ++d) {
      const double k = largest_passive_stiffness(spring(123, b, d));
      EXPECT_NEAR(passive_viscous_friction(spring(k, b, d)), 0.26, 1e-9) << b << " " << d;
    }
  }
  EXPECT_DOUBLE_EQ(largest_passive_stiffness(spring(0, 0, 0)), 520);
  EXPECT_EQ(largest_passive_stiffness(spring(0, 0.27, 0)), 0);
}

TEST(MahvashHayward, AFieldIsWhatItsSteepestSpringIs) {
  for (int d = 0; d <= 5; ++d) {
    EXPECT_NEAR(passive_viscous_friction_of_field(1000, 1ms, d), passive_viscous_friction(spring(1000, 0, d)), 1e-9);
  }
}

TEST(VirtualCoupling, IsFeltInSeries) {
  EXPECT_NEAR(felt_stiffness(468, 20'000), 457.3, 0.05);
  EXPECT_EQ(felt_stiffness(468, kInfinity), 468);
  EXPECT_EQ(felt_stiffness(468, 0), 0);
}

TEST(Jury, GivesTheNumbersOfTheSpec) {
  SampledSpring device = paper_device();
  EXPECT_NEAR(jury_stiffness(device), 520.30, 0.005);
  device.viscous = 5;
  EXPECT_NEAR(jury_stiffness(device), 10112.35, 0.005);
}

TEST(Jury, IsWhereTheSpectralRadiusIsOne) {
  for (const double b : {1e-5, 0.005, 0.05, 0.26, 1.0, 5.0, 20.0}) {
    SampledSpring device = paper_device();
    device.viscous = b;
    const double boundary = jury_stiffness(device);
    EXPECT_NEAR(largest_stable_stiffness(device) / boundary, 1, 1e-5) << b;
    if (b >= 0.005) {
      device.stiffness = 0.999 * boundary;
      EXPECT_LT(spectral_radius(device), 1) << b;
      device.stiffness = 1.001 * boundary;
      EXPECT_GT(spectral_radius(device), 1) << b;
    }
  }
}

TEST(Jury, HasNoSeamWhereTheSeriesTakesOver) {
  SampledSpring device = paper_device();
  device.viscous = 0.99999e-4 * device.mass / 1e-3;
  const double series = jury_stiffness(device) / device.viscous;
  device.viscous = 1.00001e-4 * device.mass / 1e-3;
  EXPECT_NEAR(jury_stiffness(device) / device.viscous / series, 1, 1e-8);
}

struct Ratio {
  double damping;
  int delay;
  double exact_to_linear;  ///< independent program
  double tolerance = 0.0006;
};

TEST(Gil, IsOffFromTheEigenvaluesByTheRatiosOfTheSpec) {
  for (const Ratio& row :
       {Ratio{0, 0, 1.001}, Ratio{0, 1, 1.001}, Ratio{0, 2, 1.001}, Ratio{0, 20, 1.012}, Ratio{0.5, 0, 0.994},
        Ratio{2, 0, 0.974}, Ratio{5, 0, 0.936}, Ratio{2, 20, 0.79, 0.006}, Ratio{5, 20, 0.26, 0.006}}) {
    const SampledSpring s = spring(0, row.damping, row.delay);
    EXPECT_NEAR(largest_stable_stiffness(s) / gil_stiffness(s).stiffness, row.exact_to_linear, row.tolerance)
        << row.damping << " " << row.delay;
  }
}

TEST(Gil, SaysHowFarItCanBeBelieved) {
  for (const double damping : {0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0}) {
    for (const int delay : {0, 1, 3, 10}) {
      const SampledSpring s = spring(0, damping, delay);
      const LinearLaw law = gil_stiffness(s);
      if (law.damper_share <= 0.0034) {
        EXPECT_NEAR(largest_stable_stiffness(s) / law.stiffness, 1, 0.015) << damping << " " << delay;
      }
    }
  }
}

TEST(Eigenvalues, EverySpringSofterThanTheLargestStableOneIsStable) {
  for (const double damping : {0.0, 0.5, 5.0}) {
    for (const int delay : {0, 1, 5, 20}) {
      SampledSpring s = spring(0, damping, delay);
      const double boundary = largest_stable_stiffness(s);
      for (double share = 0.001; share < 1; share *= 1.5) {
        s.stiffness = share * boundary;
        EXPECT_LT(spectral_radius(s), 1) << damping << " " << delay << " " << share;
      }
      s.stiffness = 1.001 * boundary;
      EXPECT_GT(spectral_radius(s), 1);
    }
  }
}

TEST(Eigenvalues, APassiveSpringIsStable) {
  for (const double damping : {-0.2, 0.0, 0.2}) {
    for (const int delay : {0, 1, 5}) {
      EXPECT_LE(largest_passive_stiffness(spring(0, damping, delay)),
                largest_stable_stiffness(spring(0, damping, delay)) * (1 + 1e-9));
    }
  }
}

TEST(Eigenvalues, ADamperOfTwoMassesPerPeriodIsUnstableByItself) {
  EXPECT_GT(largest_stable_stiffness(spring(0, 70, 0)), 0);
  EXPECT_EQ(largest_stable_stiffness(spring(0, 160, 0)), 0);  // 2m/T = 150 N·s/m
  SampledSpring without_friction = paper_device();
  without_friction.viscous = 0;
  EXPECT_EQ(largest_stable_stiffness(without_friction), 0);
}

TEST(AbbottOkamura, TheLesserOfHoldAndCountDecides) {
  SampledSpring device = paper_device();
  device.coulomb = 0.05;
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness(device), 520);
  device.encoder_step = 2e-4;
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness(device), 500);
  device.encoder_step = 3e-5;
  EXPECT_DOUBLE_EQ(abbott_okamura_stiffness(device), 520);
}

TEST(DiolaitiRegions, AreCutByHoldAndByCount) {
  SampledSpring device = paper_device();
  device.coulomb = 0.05;
  device.encoder_step = 2e-4;
  const auto region = [&device](double stiffness, int delay) {
    device.stiffness = stiffness;
    device.delay_samples = delay;
    return diolaiti(device).region;
  };
  EXPECT_EQ(region(0, 0), DiolaitiRegion::kPassive);
  EXPECT_EQ(region(499, 0), DiolaitiRegion::kPassive);
  EXPECT_EQ(region(510, 0), DiolaitiRegion::kLimitCycle);
  EXPECT_EQ(region(530, 0), DiolaitiRegion::kLocalLimitCycle);
  EXPECT_EQ(region(170, 1), DiolaitiRegion::kPassive);
  EXPECT_EQ(region(180, 1), DiolaitiRegion::kLocallyStable);
  const Diolaiti numbers = diolaiti(device);
  EXPECT_NEAR(numbers.beta, 0.26 / 0.18, 1e-12);
  EXPECT_NEAR(numbers.sigma, 0.05 / (180 * 2e-4), 1e-12);
  EXPECT_EQ(numbers.tau, 1);
}

TEST(DiolaitiRegions, TheSpeedLimitIsInfiniteExactlyWhereTheHoldIsPaidFor) {
  SampledSpring device = paper_device();
  device.coulomb = 0.05;
  device.stiffness = 519;
  EXPECT_EQ(diolaiti(device).speed_limit, kInfinity);
  device.stiffness = 620;
  EXPECT_NEAR(diolaiti(device).speed_limit, 4 / 3.14159265 * 0.05 / 0.05, 1e-6);
}

TEST(StabilityLaws, NameTheFieldThatIsWrong) {
  SampledSpring s = paper_device();
  s.viscous = -1;
  EXPECT_EQ(thrown_by([&] { spectral_radius(s); }), "viscous = -1: expected a finite number ≥ 0");
  s = paper_device();
  s.period = Duration::zero();
  EXPECT_EQ(thrown_by([&] { passive_viscous_friction(s); }), "period = 0: expected more than 0 s");
  s = paper_device();
  s.stiffness = std::nan("");
  EXPECT_EQ(thrown_by([&] { diolaiti(s); }), "stiffness = nan: expected a finite number ≥ 0");
  s = paper_device();
  s.delay_samples = 201;
  EXPECT_EQ(thrown_by([&] { gil_stiffness(s); }), "delay_samples = 201: expected 0 to 200");
  s = paper_device();
  s.mass = 0;
  EXPECT_EQ(thrown_by([&] { largest_stable_stiffness(s); }), "mass = 0: expected a finite number above 0");
}

TEST(StabilityLaws, RefuseWhatTheyKnowNothingOf) {
  EXPECT_EQ(thrown_by([] { diolaiti(spring(500, 0.1, 0)); }),
            "damping = 0.1: expected 0, because this law does not support a virtual damper");
  EXPECT_NE(thrown_by([] { jury_stiffness(spring(500, 0.1, 0)); }), "");
  EXPECT_NE(thrown_by([] { jury_stiffness(spring(500, 0, 1)); }), "");
  EXPECT_NE(thrown_by([] { abbott_okamura_stiffness(spring(500, 0, 1)); }), "");
}

}  // namespace
}  // namespace tendon::closed_forms_test
