// SPDX-License-Identifier: Apache-2.0
// A toy worker that obeys all rules passes. One that violates one rule fails the check for that rule only.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>

#include "tests/tools/conformance/toy/worker.h"
#include "tests/tools/conformance/worker_checks.h"

namespace tendon::conformance::worker_kit_test {
namespace {

Report report_of(WorkerFault fault) {
  ToyWorker worker(fault);
  Report report(Side::kWorker);
  judge_worker(worker, report);
  return report;
}

std::string told(const Report& report) {
  std::string out;
  for (const Verdict& verdict : report.verdicts()) {
    if (verdict.outcome != Outcome::kPassed) out += text_of(verdict) + '\n';
  }
  return out;
}

struct Case {
  WorkerFault fault;
  std::string_view check;
};

std::string name_of(const testing::TestParamInfo<Case>& tested) {
  std::string out(tested.param.check);
  std::ranges::replace(out, '-', '_');
  return out + "_" + std::to_string(tested.index);
}

class BrokenWorker : public testing::TestWithParam<Case> {};

TEST_P(BrokenWorker, FailsTheCheckOfTheRuleItBreaksAndNoOther) {
  const Report report = report_of(GetParam().fault);
  std::set<std::string_view> failed;
  for (const Verdict& verdict : report.verdicts()) {
    if (verdict.outcome == Outcome::kFailed) failed.insert(verdict.check->name);
  }
  EXPECT_EQ(failed, std::set{GetParam().check}) << told(report);
  EXPECT_FALSE(report.passed());
}

INSTANTIATE_TEST_SUITE_P(
    Worker, BrokenWorker,
    testing::Values(
        Case{WorkerFault::kNeverOpens, "stream-opens"}, Case{WorkerFault::kEndsAtOnce, "stream-opens"},
        Case{WorkerFault::kWrongSecret, "stream-opens"}, Case{WorkerFault::kOpensWithASequence, "stream-opens"},
        Case{WorkerFault::kKnowsNoTcp, "stream-opens"}, Case{WorkerFault::kCountsItself, "answer-comes"},
        Case{WorkerFault::kNoLength, "record-length"}, Case{WorkerFault::kTalksUnasked, "stream-silent"},
        Case{WorkerFault::kAnswersTwice, "stream-silent"}, Case{WorkerFault::kEndsAfterAnAnswer, "stream-silent"},
        Case{WorkerFault::kNeverAnswers, "answer-comes"}, Case{WorkerFault::kDiesOfAState, "answer-comes"},
        Case{WorkerFault::kSequenceOfItsOwn, "answer-sequence"}, Case{WorkerFault::kBodyHasAHeader, "answer-body"},
        Case{WorkerFault::kTwoForces, "answer-body"}, Case{WorkerFault::kSendsTheStateBack, "answer-body"},
        Case{WorkerFault::kTickIsADouble, "answer-names-state"},
        Case{WorkerFault::kForcesOfOneSequence, "answer-names-state"}, Case{WorkerFault::kNotFinite, "answer-bounds"},
        Case{WorkerFault::kFarTooLarge, "answer-bounds"}, Case{WorkerFault::kFarTorque, "answer-bounds"},
        Case{WorkerFault::kNoValidity, "answer-bounds"}, Case{WorkerFault::kOneReadIsARecord, "state-in-pieces"},
        Case{WorkerFault::kDiesOfATurn, "state-of-a-handle"}, Case{WorkerFault::kByteOfButtons, "state-of-a-handle"},
        Case{WorkerFault::kDiesOfTheUnknown, "state-unknown-field"},
        Case{WorkerFault::kTiresOfStates, "states-in-a-row"}, Case{WorkerFault::kOutlivesItsStream, "stream-ends"}),
    name_of);

TEST(ConformanceKit, AWorkerThatKeepsAllRulesPasses) {
  const Report report = report_of(WorkerFault::kNone);
  EXPECT_TRUE(report.passed()) << told(report);
  EXPECT_EQ(report.count(Outcome::kNotApplicable), 0U);
}

TEST(ConformanceKit, AWorkerThatKnowsNoForcePassesAndIsNotJudgedByOne) {
  const Report report = report_of(WorkerFault::kKnowsNoForce);
  EXPECT_TRUE(report.passed()) << told(report);
  EXPECT_EQ(report.count(Outcome::kNotApplicable), 2U);
}

TEST(ConformanceKit, SaysOverWhichRoadAWorkerFails) {
  EXPECT_NE(told(report_of(WorkerFault::kKnowsNoTcp)).find("over TCP: "), std::string::npos);
}

}  // namespace
}  // namespace tendon::conformance::worker_kit_test
