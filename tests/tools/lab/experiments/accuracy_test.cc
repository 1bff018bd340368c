// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/accuracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/refusal.h"

namespace tendon::lab::accuracy_test {
namespace {

using softbody::Element;
using softbody::Law;
using softbody::ModelKind;

/// Published: computed with deal.II, to 0.1 %.
constexpr double kB1 = 420.2;
constexpr double kB1NearlyIncompressible = 450.9;

/// Coarser than the verb's default, which takes half a minute.
constexpr Truth::Config kCoarse{.cells = 2, .cells_for_large = 1.5};

/// A smaller block than B1 with the same patch, which makes large strains cheaper.
Truth& truth() {
  static Truth the({.size = {0.06, 0.06, 0.03}}, kCoarse);
  return the;
}

TEST(AccuracyTruth, OfTheBlockB1IsThatOfOtherPeoplesFiniteElements) {
  Truth b1({}, kCoarse);
  EXPECT_NEAR(b1.limit(Law::kLinear, 0)->secant / kB1, 1, 0.01);
}

TEST(AccuracyTruth, DoesNotLockWhenTheMaterialIsNearlyIncompressible) {
  PressedBlock block;
  block.material.poisson = 0.499;
  block.loads = {0.01, 0.02};  // very small strain, which is fast
  EXPECT_NEAR(Truth(block, kCoarse).limit(Law::kLinear, 0)->secant / kB1NearlyIncompressible, 1, 0.01);
}

TEST(AccuracyTruth, SaysHowFarItsOwnMeshesLeaveItOpen) {
  const double coarse = truth().uncertainty();
  EXPECT_GT(coarse, 1e-3);
  EXPECT_LT(coarse, 0.06);
  Truth finer(truth().block(), {.cells = 3});
  EXPECT_LT(std::abs(finer.limit(Law::kLinear, 0)->secant / truth().limit(Law::kLinear, 0)->secant - 1), coarse);
}

TEST(AccuracyTruth, ChangesUnderAHardPressAsANeoHookeanSolidOfAnotherElement) {
  const auto press = [&](ModelKind model) {
    softbody::BodyConfig config;
    config.shape = softbody::BlockShape{truth().block().size, {8, 8, 4}};
    config.element = Element::kHex8Sri;
    config.material = truth().block().material;
    config.model = softbody::model_config(model);
    config.patch_radius = truth().block().patch_radius;
    const double load = truth().block().loads[1];
    return load / softbody::Body(config).press(softbody::Prescribed::kForce, load).depth;
  };
  const double ratio = press(ModelKind::kNeoHookean) / press(ModelKind::kLinear);
  EXPECT_NEAR(truth().stiffness(1).secant / truth().limit(Law::kLinear, 1)->secant, ratio, 0.01);
}

TEST(AccuracyTruth, ItsForceIsThatOfItsStiffnessAtBothLoadsAndNoneOutside) {
  const auto& block = truth().block();
  for (const std::size_t load : {0U, 1U}) {
    const double depth = block.loads[load] / truth().stiffness(load).secant;
    const softbody::Vec3 force = truth().force(block.touch_point() - softbody::Vec3(0, 0, depth));
    EXPECT_NEAR(force.z(), block.loads[load], 1e-9);
    EXPECT_LT(force.head<2>().norm(), 1e-6);
  }
  EXPECT_EQ(truth().force(block.touch_point() + softbody::Vec3(0, 0, 1e-4)).norm(), 0);
}

TEST(AccuracyTruth, ItsScriptPressesAsFarAsTheFirstLoadSlidesAndComesOff) {
  double most = 0;
  double aside = 0;
  for (const Touched& there : truth().script()) {
    most = std::max(most, there.force.z());
    aside = std::max(aside, there.tool.x());
  }
  EXPECT_NEAR(most, 0.3, 0.01);
  EXPECT_NEAR(aside, 0.005, 1e-4);
  EXPECT_EQ(truth().script().front().force.norm(), 0);
  EXPECT_EQ(truth().script().back().force.norm(), 0);
}

TEST(Accuracy, PartsOfAnErrorAddUpToItAndAreWhereTheyBelong) {
  const Meter meter;
  for (const ModelKind model : {ModelKind::kCondensed, ModelKind::kNeoHookean}) {
    const AccuracyPoint point = measure({model, Element::kHex8Sri, 4}, truth(), meter);
    for (const Accuracy& at : point.at_load) {
      EXPECT_NEAR(at.model + at.discretisation + at.solver, at.total, 1e-12);
      EXPECT_LT(std::abs(at.solver), 1e-5);
      EXPECT_GT(at.discretisation, 0.05);
    }
    const double linear = truth().limit(Law::kLinear, 1)->secant / truth().stiffness(1).secant - 1;
    EXPECT_GT(std::abs(linear), 2e-3);
    EXPECT_NEAR(point.at_load[1].model, model == ModelKind::kCondensed ? linear : 0,
                1e-12);  // the truth is Neo-Hookean
  }
}

TEST(Accuracy, TheScriptSeesTheErrorOfTheStiffnessAndNoPushAside) {
  const Meter meter;
  const AccuracyPoint point = measure({ModelKind::kCondensed, Element::kHex8Sri, 8}, truth(), meter);
  EXPECT_NEAR(point.force_relative, point.at_load[0].total, 0.02);
  EXPECT_GT(point.force_most, point.force_error);
  EXPECT_LT(point.lateral, 1e-3);
  // A mesh of tetrahedra with an odd number of cells is not symmetric, so it has a lateral error.
  EXPECT_GT(measure({ModelKind::kCondensed, Element::kTet4, 5}, truth(), meter).lateral, 10 * point.lateral);
}

TEST(Accuracy, WhatNearHasLearnedAndItsTableAnswerAsNearDoesToTheirTolerance) {
  const Meter meter;
  Candidate candidate{ModelKind::kNear, Element::kHex8Sri, 6};
  const AccuracyPoint near = measure(candidate, truth(), meter);
  for (const Candidate::By by : {Candidate::By::kLearned, Candidate::By::kTable}) {
    candidate.by = by;
    const AccuracyPoint point = measure(candidate, truth(), meter);
    EXPECT_EQ(point.candidate.name(), by == Candidate::By::kTable ? "near-table-hex8-sri" : "near-learned-hex8-sri");
    for (std::size_t load = 0; load < 2; ++load) {
      EXPECT_NEAR(point.at_load[load].total, near.at_load[load].total, 0.02);
    }
    EXPECT_GT(std::abs(point.force_relative - near.force_relative), 1e-6) << "near has answered";
    EXPECT_NEAR(point.force_relative, near.force_relative, 0.02);
  }
}

TEST(Accuracy, RefusesWhatWasLearnedWithoutABodyThatLearns) {
  AccuracyOptions options;
  options.models = {ModelKind::kLinear};
  options.learned = true;
  std::ostringstream out;
  EXPECT_THROW(accuracy(options, out), std::invalid_argument);
}

TEST(Accuracy, AWorkersRowIsThatOfTheSameBodyHereWithinTheErrorThatItSends) {
  const std::string worker = TENDON_FEM_WORKER;
  if (worker.empty()) GTEST_SKIP() << "tendon-fem-worker is not built here: it needs PETSc and MPI";
  for (const char* name : {"OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMP_NUM_THREADS"}) {
    setenv(name, "1", 1);  // NOLINT(concurrency-mt-unsafe): one thread
  }
  const Meter meter;
  const Network near{.name = "base=0.05ms"};
  Candidate candidate{ModelKind::kLinear, Element::kHex27Sri, 4};
  const AccuracyPoint here = measure(candidate, truth(), meter, near);
  candidate.by = Candidate::By::kWorker;
  const AccuracyPoint there = measure(candidate, truth(), meter, near, {}, worker + " --way multigrid");
  EXPECT_EQ(there.candidate.name(), "worker-hex27-sri");
  EXPECT_EQ(there.size.free, here.size.free);
  EXPECT_FALSE(there.instructions) << "they would be those of waiting";
  for (std::size_t load = 0; load < 2; ++load) {
    const Accuracy& at = there.at_load[load];
    EXPECT_GT(at.solver, 0);
    EXPECT_LT(at.solver, 0.01);
    EXPECT_NEAR(at.total, here.at_load[load].total, at.solver);
    EXPECT_NEAR(at.tangent, here.at_load[load].tangent, at.solver);
    EXPECT_NEAR(at.model + at.discretisation + at.solver, at.total, 1e-12);
  }
  EXPECT_NEAR(there.force_relative, here.force_relative, 0.01);
  EXPECT_LT(there.lateral, 0.01);
  EXPECT_GT(there.update_ms_p50, 0);
  EXPECT_NEAR(there.felt->displayed, here.felt->displayed, 0.05);
}

TEST(Accuracy, AWorkerThatDoesNotStartIsOneSentence) {
  const Meter meter;
  EXPECT_NE(thrown_by<std::runtime_error>([&] {
              measure({ModelKind::kLinear, Element::kHex8Sri, 4, Candidate::By::kWorker}, truth(), meter, {}, {},
                      "no-such-worker");
            }).find("no-such-worker"),
            std::string::npos);
}

TEST(Accuracy, TheParetoFrontKeepsWhatNothingElseIsBothQuickerAndCloserThan) {
  const auto point = [](double ms, double model, double mesh) {
    AccuracyPoint p{.candidate = {ModelKind::kLinear, Element::kTet4, 4}};
    p.update_ms_p50 = ms;
    p.at_load[0] = {.total = model + mesh, .model = model, .discretisation = mesh};
    return p;
  };
  const auto front = pareto_front({point(3, 0, -0.1), point(1, 0.2, 0.3), point(2, 0, 0.6), point(4, 0, 0.2),
                                   point(0.5, std::nan(""), 0), point(5, 0.3, -0.3)},
                                  0);
  ASSERT_EQ(front.size(), 2U);
  EXPECT_EQ(front[0].update_ms_p50, 1);
  EXPECT_EQ(front[1].update_ms_p50, 3);  // the last one is accurate only because its errors cancel
}

TEST(Accuracy, TheExponentOfItsCostIsThatOfItsLadderAndOneMeshHasNone) {
  const auto ladder = [](double power) {
    std::vector<AccuracyPoint> points;
    for (const std::size_t free : {150U, 972U, 6936U}) {
      AccuracyPoint p{.candidate = {ModelKind::kLinear, Element::kTet4, 4}};
      p.size.free = free;
      p.update_ms_p50 = 0.01 * std::pow(static_cast<double>(free), power);
      points.push_back(p);
    }
    return points;
  };
  EXPECT_NEAR(cost_exponent(ladder(1.4)), 1.4, 1e-12);
  EXPECT_NEAR(cost_exponent(ladder(0)), 0, 1e-12);
  EXPECT_TRUE(std::isnan(cost_exponent({ladder(1).front()})));
  EXPECT_TRUE(std::isnan(cost_exponent({})));
}

TEST(Accuracy, AnAsRigidAsPossibleBodyHasNoLambdaAndItsRoundsConverge) {
  const AccuracyPoint point = measure({softbody::compared::Kind::kProjective, Element::kHex8Sri, 4}, truth(), Meter());
  for (const Accuracy& at : point.at_load) {
    EXPECT_NEAR(at.model + at.discretisation + at.solver, at.total, 1e-12);
    EXPECT_LT(std::abs(at.solver), 1e-3);
    EXPECT_GT(at.discretisation, 0.02);
    EXPECT_LT(at.model, -0.3);  // no volumetric stiffness
  }
}

TEST(Accuracy, TheLimitOfSpringsHardlyDependsOnTheMeshItIsSeenOn) {
  const auto at = [](int n) {
    const AccuracyPoint point = measure({softbody::compared::Kind::kMassSpring, Element::kTet4, n}, truth(), Meter());
    EXPECT_NEAR(point.at_load[0].model + point.at_load[0].discretisation, point.at_load[0].total, 1e-12);
    return point.at_load[0];
  };
  const Accuracy coarse = at(4);
  const Accuracy fine = at(8);
  EXPECT_GT(coarse.total - fine.total, 0.3);
  EXPECT_LT(std::abs(coarse.model - fine.model), 0.1);
}

TEST(Accuracy, WhatIsFarTooSlowIsNotMeasuredToItsEnd) {
  EXPECT_THROW(measure({ModelKind::kCorotational, Element::kHex8Sri, 4}, truth(), Meter(), {}, {.update_ms = 1e-4}),
               TooSlow);
  EXPECT_THROW(
      measure({ModelKind::kLinear, Element::kHex8Sri, 4}, truth(), Meter(), Network{.name = "lan"}, {.felt_s = 0}),
      TooSlow);
}

TEST(Accuracy, OnlyWhatNothingElseIsAsQuickAndCloserThanMayBeBestAtTheHand) {
  const auto point = [](double ms, double small, double hard) {
    AccuracyPoint p{.candidate = {ModelKind::kLinear, Element::kTet4, 4}};
    p.update_ms_p50 = ms;
    p.at_load[0] = {.total = small, .model = small};
    p.at_load[1] = {.total = hard, .model = hard};
    return p;
  };
  const std::vector<AccuracyPoint> others{point(2, 0.05, 0.1)};
  EXPECT_FALSE(may_be_best(point(3, 0.06, 0.2), others));
  EXPECT_FALSE(may_be_best(point(2, 0.05, 0.1), others));
  EXPECT_TRUE(may_be_best(point(3, 0.04, 0.2), others));
  EXPECT_TRUE(may_be_best(point(3, 0.06, 0.09), others));
  EXPECT_TRUE(may_be_best(point(1, 0.5, 0.5), others));
  EXPECT_TRUE(may_be_best(point(3, 0.5, 0.5), {}));
  EXPECT_FALSE(may_be_best(point(0.01, 0.06, 0.2), {point(0.05, 0.05, 0.1)}));
  AccuracyPoint steps = point(1, 0.06, 0.2);
  steps.step_ms = 4;
  EXPECT_FALSE(may_be_best(steps, others));
  AccuracyPoint lucky = point(3, 0.01, 0.01);
  EXPECT_TRUE(may_be_best(lucky, others));
  for (Accuracy& at : lucky.at_load) at = {.total = 0.01, .model = -0.2, .discretisation = 0.21};
  EXPECT_FALSE(may_be_best(lucky, others));
}

TEST(Accuracy, TheAnswerWithinABudgetIsTheClosestOfThoseThatAreQuickEnough) {
  AccuracyOptions options;
  options.block = truth().block();
  options.block.loads = {0.01, 0.02};  // very small strain, which is fast
  options.truth = kCoarse;
  options.models = {ModelKind::kCondensed, ModelKind::kLinear};
  options.elements = {Element::kHex8Sri, Element::kHex27Sri};
  options.resolutions = {3, 4};
  options.network = Network{.name = "lan"};
  options.budget_ms = 1000;
  options.json = true;
  std::ostringstream out;
  accuracy(options, out);
  EXPECT_NE(out.str().find("\"model\":\"condensed-hex27-sri\",\"n\":4,"), std::string::npos) << out.str();
  EXPECT_NE(out.str().find("\"felt_error_percent\":"), std::string::npos) << out.str();
  options.budget_ms = 1e-9;
  out.str("");
  accuracy(options, out);
  EXPECT_NE(out.str().find("\"model\":null"), std::string::npos) << out.str();
}

TEST(Accuracy, APointInJsonBeginsAsTheManualSays) {
  const std::string line = to_json(measure({ModelKind::kLinear, Element::kHex8Sri, 4}, truth(), Meter()), truth());
  std::size_t at = 0;
  for (const char* key : {"{\"model\":\"linear-hex8-sri\",\"n\":4,\"nodes\":75,\"k_n_per_m\":", ",\"error_percent\":",
                          ",\"update_ms_p50\":", ",\"setup_s\":", ",\"bytes\":"}) {
    const std::size_t found = line.find(key, at);
    ASSERT_NE(found, std::string::npos) << key << " in " << line;
    at = found;
  }
}

TEST(Accuracy, RefusesWhatMakesNoBlock) {
  std::ostringstream out;
  const auto with = [](auto change) {
    AccuracyOptions options;
    change(options);
    return options;
  };
  EXPECT_THROW(accuracy(with([](auto& o) { o.block.size.x() = -1; }), out), std::invalid_argument);
  EXPECT_THROW(accuracy(with([](auto& o) { o.block.loads = {1, 0.3}; }), out), std::invalid_argument);
  EXPECT_THROW(accuracy(with([](auto& o) { o.block.patch_centre.x() = 1; }), out), std::invalid_argument);
  EXPECT_THROW(accuracy(with([](auto& o) { o.resolutions = {8, 4}; }), out), std::invalid_argument);
  EXPECT_THROW(accuracy(with([](auto& o) { o.budget_ms = 5; }), out), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::lab::accuracy_test
