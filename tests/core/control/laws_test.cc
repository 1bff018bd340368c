// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <string_view>

#include "core/control/energy_bounding.h"
#include "core/control/force_bounding.h"
#include "core/control/hard_clamp.h"
#include "core/control/nonlinear_coupling.h"
#include "core/control/passive_synthesis.h"
#include "core/control/passivity_controller.h"
#include "core/control/port_hamiltonian.h"
#include "core/control/reference_energy.h"
#include "core/control/unlimited.h"
#include "core/control/virtual_coupling.h"
#include "tests/core/control/adversary.h"
#include "tests/core/control/press.h"
#include "tests/support/refusal.h"

namespace tendon::laws_test {
namespace {

using std::chrono::milliseconds;
using enum PassivityObserver;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr Friction kFriction{0.05, 0.26};
constexpr Duration kPeriod = milliseconds(1);
constexpr Friction kSmooth{0.05, 0};
constexpr Duration kNever{};

TEST(Laws, KeepTheCommonPromises) {
  const auto row = [](const char* law, auto make) {
    SCOPED_TRACE(law);
    expect_the_common_promises<1>(make.template operator()<1>(), kFriction);
    expect_the_common_promises<3>(make.template operator()<3>(), kFriction);
    expect_the_common_promises<6>(make.template operator()<6>(), kFriction);
  };
  row("unlimited", []<int N>() { return Unlimited<N>({kFriction}); });
  row("hard clamp", []<int N>() { return HardClamp<N>({kFriction, 8.5}); });
  row("virtual coupling", []<int N>() { return VirtualCoupling<N>({kFriction, kPeriod, 400, 0.05}); });
  row("passive synthesis", []<int N>() { return PassiveSynthesis<N>({kFriction, kPeriod}); });
  row("reference energy", []<int N>() { return ReferenceEnergyController<N>({kFriction, 500, 20}); });
  row("energy bounding", []<int N>() { return EnergyBounding<N>({kFriction, kPeriod}); });
  row("nonlinear coupling", []<int N>() { return NonlinearCoupling<N>({kFriction, kPeriod}); });
  row("force bounding", []<int N>() { return ForceBounding<N>({kFriction, kPeriod}); });
  row("memoryless force bounding", []<int N>() { return MemorylessForceBounding<N>({kFriction, kPeriod}); });
  row("port-Hamiltonian", []<int N>() { return PortHamiltonian<N>({kFriction, 500}); });
  for (const auto seen : {kSameSample, kZohExact}) {
    row("passivity", [=]<int N>() { return PassivityController<N>({kFriction, seen, N < 6 ? 20 : kInf}); });
    row("parallel passivity", [=]<int N>() {
      return ParallelPassivityController<N>({kFriction, seen, N < 6 ? 0.1 : kInf});
    });
  }
}

TEST(Laws, OfThePassiveOnesNoAdversaryDrawsEnergy) {
  const auto row = [](const char* law, auto make) {
    SCOPED_TRACE(law);
    const auto in = [&]<int N>(int seeds) {
      return broken_by_hostile_worlds<N>([&](Friction f, Duration t) { return make.template operator()<N>(f, t); },
                                         seeds);
    };
    EXPECT_EQ(in.template operator()<1>(400), 0) << "on one axis";
    EXPECT_EQ(in.template operator()<3>(400), 0) << "at a point";
    EXPECT_EQ(in.template operator()<6>(100), 0) << "on six axes";
  };
  row("energy bounding", []<int N>(Friction f, Duration t) { return EnergyBounding<N>({f, t}); });
  row("nonlinear coupling", []<int N>(Friction f, Duration t) { return NonlinearCoupling<N>({f, t}); });
  row("force bounding", []<int N>(Friction f, Duration t) { return ForceBounding<N>({f, t}); });
  row("memoryless force bounding", []<int N>(Friction f, Duration t) { return MemorylessForceBounding<N>({f, t}); });
}

/// The passivity and reference-energy controllers react one interval late.
TEST(Laws, OfTheOthersAdversariesDrawEnergyInMostWorlds) {
  const auto row = [](const char* law, int more_than, auto make) {
    EXPECT_GT(broken_by_hostile_worlds<3>([&](Friction f, Duration) { return make(f); }, 50), more_than) << law;
  };
  row("unlimited", 45, [](Friction f) { return Unlimited<3>({f}); });
  row("hard clamp", 45, [](Friction f) { return HardClamp<3>({f, 5}); });
  row("passivity", 25, [](Friction f) { return PassivityController<3>({f, kZohExact, kInf}); });
  row("reference energy", 25, [](Friction f) { return ReferenceEnergyController<3>({f, 500, 1e9}); });
}

TEST(Laws, ShowStiffWallsAsStiffAsTheyMayAndQuietly) {
  const auto row = [](const char* law, double wall, const Press& found, double stiffness, double tolerance) {
    EXPECT_NEAR(found.stiffness, stiffness, tolerance) << law << ", wall " << wall;
    EXPECT_LT(found.unrest, 2e-3) << law << ", wall " << wall;
  };
  const auto passive = [&](const char* law, double wall, const Press& found, double stiffness, double tolerance) {
    row(law, wall, found, stiffness, tolerance);
    EXPECT_GE(found.least_work, -1e-12) << law << ", wall " << wall;
  };
  const double coupled = 0.9 * colgate_coupling(0.26, kPeriod, 0);
  for (const double wall : {800.0, 3000.0, 20000.0}) {
    passive("energy bounding, b/T", wall, press(EnergyBounding<1>({kPressFriction, kPeriod}), wall), 261, 26);
    passive("nonlinear coupling, 2b/T", wall, press(NonlinearCoupling<1>({kPressFriction, kPeriod}), wall), 521, 52);
    passive("memoryless, 2b/T", wall, press(MemorylessForceBounding<1>({kPressFriction, kPeriod}), wall), 521, 52);
    row("reference energy", wall, press(ReferenceEnergyController<1>({kPressFriction, wall, 20}), wall), wall,
        0.05 * wall);
    row("passivity, zoh-exact, a modest damper", wall,
        press(PassivityController<1>({kPressFriction, kZohExact, 100}), wall), wall, 0.01 * wall);
    if (wall < 1000) continue;
    row("passive synthesis, 2b/T", wall, press(PassiveSynthesis<1>({kPressFriction, kPeriod, {}, wall}), wall), 520,
        10);
    const double series = coupled * wall / (coupled + wall);
    row("virtual coupling, in series", wall, press(VirtualCoupling<1>({kPressFriction, kPeriod, coupled}), wall),
        series, 0.02 * series);
  }
  row("force bounding, 2b/T", 20000, press(ForceBounding<1>({kPressFriction, kPeriod}), 20000), 521, 52);
  EXPECT_NEAR(press(VirtualCoupling<1>({kPressFriction, kPeriod, coupled}), 1e7).stiffness, 468, 10);
  const Press soft = press(Unlimited<1>({kPressFriction}), 800);
  row("unlimited", 800, soft, 800, 8);
}

TEST(Laws, ThatLimitNoEnergyAreThrownOffAStiffWall) {
  EXPECT_GT(press(Unlimited<1>({kPressFriction}), 20000).unrest, 0.5);
  EXPECT_GT(press(HardClamp<1>({kPressFriction, 8.5}), 20000).unrest, 0.05);
}

TEST(Laws, RefuseImpossibleConfigurations) {
  const auto row = [](std::string_view says, auto make) {
    const std::string message = thrown_by(make);
    EXPECT_NE(message.find(says), std::string::npos) << message << "\nexpected: " << says;
  };
  row("max_force = -1: expected", [] { HardClamp<3>({kFriction, -1}); });
  row("max_force = inf: expected", [] { HardClamp<1>({kFriction, kInf}); });
  row("coulomb = -1: expected", [] { HardClamp<1>({{-1, 0.26}, 1}); });
  row("= 0: expected a number above 0 N·s/m", [] { PassivityController<1>({kFriction, kZohExact, 0}); });
  row("= -1: expected", [] { PassivityController<1>({kFriction, kZohExact, 5, -1}); });
  row("max_mobility = -1: expected", [] { ParallelPassivityController<1>({kFriction, kZohExact, -1}); });
  row("= inf: expected", [] { ParallelPassivityController<1>({kFriction, kZohExact, 1, kInf}); });
  row("= 0: expected a finite number above 0 N/m", [] { PortHamiltonian<1>({kFriction, 0}); });
  row("= 521: expected a number above 0 and at most 2b/T = 520", [] {
    NonlinearCoupling<1>({kFriction, kPeriod, 521});
  });
  row("viscous = 0: expected", [] { NonlinearCoupling<1>({kSmooth, kPeriod}); });
  row("longest_hold = 0: expected", [] { NonlinearCoupling<1>({kFriction, kNever}); });
  row("delay = -0.001: expected", [] { PassiveSynthesis<1>({kFriction, kPeriod, milliseconds(-1)}); });
  row("= -1: expected", [] { PassiveSynthesis<1>({kFriction, kPeriod, {}, -1}); });
  row("viscous = 0: expected", [] { PassiveSynthesis<1>({kSmooth, kPeriod}); });
  row("longest_hold = 0: expected", [] { PassiveSynthesis<1>({kFriction, kNever}); });
  row("= 0: expected a finite number above 0 N/m", [] { VirtualCoupling<1>({kFriction, kPeriod, 0}); });
  row("= -0.1: expected", [] { VirtualCoupling<1>({kFriction, kPeriod, 400, -0.1}); });
  row("longest_hold = 0: expected", [] { VirtualCoupling<1>({kFriction, kNever, 400, 0}); });
  row("viscous = 0: expected a finite number above 0", [] { ForceBounding<1>({kSmooth, kPeriod}); });
  row("longest_hold = 0: expected", [] { MemorylessForceBounding<3>({kFriction, kNever}); });
  row("= 0: expected a finite number above 0 N/m", [] { ReferenceEnergyController<1>({kFriction, 0, 20}); });
  row("= 0: expected", [] { ReferenceEnergyController<1>({kFriction, 500, 0}); });
  row("= -1: expected", [] { ReferenceEnergyController<1>({kFriction, 500, 20, -1}); });
  row("c1 = 261: expected a number above 0 and at most b/T = 260", [] {
    EnergyBounding<1>({kFriction, kPeriod, 261});
  });
  row("c2 = 201: expected a number above 0 and at most c1 = 200", [] {
    EnergyBounding<1>({kFriction, kPeriod, 200, 201});
  });
  row("c1 = 0: expected", [] { EnergyBounding<1>({kFriction, kPeriod, 0}); });
  row("longest_hold = 0: expected", [] { EnergyBounding<1>({kFriction, kNever}); });
  row("viscous = 0: expected", [] { EnergyBounding<1>({kSmooth, kPeriod}); });
  EXPECT_NO_THROW(EnergyBounding<1>({kFriction, kPeriod, 200, 200}));
}

TEST(HardClamp, BoundsTheSizeKeepsTheDirectionAndSaysWhy) {
  HardClamp<3> law({kFriction, 5});
  const LimitedForce<3> limited = law.limit({Vec3(30, 0, -40)});
  EXPECT_TRUE(limited.force.isApprox(Vec3(3, 0, -4), 1e-15));
  EXPECT_TRUE(limited.reasons.has(Reason::kMaxForce));
  EXPECT_TRUE(law.limit({Vec3(3, 0, -4)}).reasons.empty());
  EXPECT_LE(law.limit({Vec3(1e300, -1e300, 1e300)}).force.norm(), 5 * (1 + 1e-15));
}

TEST(Unlimited, LetsEverythingFiniteThrough) {
  Unlimited<3> law({kFriction});
  const LimitedForce<3> limited = law.limit({Vec3(1e9, -1, 0)});
  EXPECT_EQ(limited.force, Vec3(1e9, -1, 0));
  EXPECT_TRUE(limited.reasons.empty());
  EXPECT_EQ(limited.permitted, kInf);
}

}  // namespace
}  // namespace tendon::laws_test
