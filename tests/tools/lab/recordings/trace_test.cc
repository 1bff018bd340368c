// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/trace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "tests/tools/lab/experiments/steps.h"

namespace tendon::lab::trace_test {
namespace {

using namespace std::chrono_literals;
using testing::step_at;

Trace trace_of(std::size_t columns, Duration span = 1s) {
  return Trace({.start = step_at(0).hand.at, .span = span, .columns = columns, .axis = Vec3::UnitX()});
}

TEST(Trace, OneSpikeInAThousandStepsIsNotLost) {
  Trace trace = trace_of(10);
  for (std::uint64_t n = 0; n <= 1000; ++n) {
    StepRecord step = step_at(n);
    if (n == 555) {
      step.hand.position.x() = 0.5;
      step.applied.x() = -7;
      step.wanted.x() = 70;
      step.energy = -3;
    }
    trace.observe(step);
  }
  const Trace::Column& hit = trace.columns()[5];
  EXPECT_EQ(hit.position.most, 0.5);
  EXPECT_EQ(hit.applied.least, -7);
  EXPECT_EQ(hit.wanted.most, 70);
  EXPECT_EQ(hit.energy.least, -3);
  EXPECT_EQ(trace.columns()[4].energy.least, 0);
}

TEST(Trace, ABuzzStaysAsTallAsItWasHoweverNarrowThePicture) {
  for (const std::size_t columns : {1U, 7U, 100U}) {
    Trace trace = trace_of(columns);
    for (std::uint64_t n = 0; n <= 1000; ++n) {
      StepRecord step = step_at(n);
      step.hand.position.x() = n % 2 == 0 ? 0.01 : -0.01;
      trace.observe(step);
    }
    for (const Trace::Column& column : trace.columns()) {
      EXPECT_EQ(column.position.least, -0.01);
      EXPECT_EQ(column.position.most, 0.01);
    }
  }
}

TEST(Trace, ExtremesAreDrawnInTheOrderInWhichTheyCame) {
  Extremes rising;
  for (const double v : {0.0, -1.0, 2.0}) rising.observe(v);
  EXPECT_EQ(rising.first(), -1);
  EXPECT_EQ(rising.second(), 2);
  Extremes falling;
  for (const double v : {0.0, 2.0, -1.0}) falling.observe(v);
  EXPECT_EQ(falling.first(), 2);
  EXPECT_EQ(falling.second(), -1);
}

TEST(Trace, NotANumberAndAMissingPositionSayNothing) {
  Trace trace = trace_of(1);
  StepRecord step = step_at(0);
  step.wanted.x() = NAN;
  step.reasons = Reason::kUnseen;
  trace.observe(step);
  EXPECT_TRUE(trace.columns()[0].wanted.empty());
  EXPECT_TRUE(trace.columns()[0].position.empty());
  EXPECT_TRUE(trace.columns()[0].permitted.empty());  // infinite: no bound
  EXPECT_FALSE(trace.columns()[0].empty());
}

TEST(Trace, TheFirstAndTheLastStepAreInAndOthersOutsideAreNot) {
  Trace trace = trace_of(4, 100ms);
  for (const std::uint64_t n : {0U, 100U, 101U}) {
    StepRecord step = step_at(n);
    step.energy = static_cast<double>(n + 1);
    trace.observe(step);
  }
  StepRecord before = step_at(0);
  before.hand.at -= 1ns;
  before.energy = -5;
  trace.observe(before);
  EXPECT_EQ(trace.columns()[0].energy.least, 1);
  EXPECT_EQ(trace.columns()[3].energy.most, 101);
  EXPECT_DOUBLE_EQ(trace.time(0), 0.0125);
}

TEST(Trace, AnOverrunMarksItsColumn) {
  Trace trace = trace_of(10);
  StepRecord step = step_at(321);
  step.reasons = Reason::kOverrun;
  trace.observe(step);
  EXPECT_TRUE(trace.columns()[3].overrun);
  EXPECT_EQ(std::ranges::count_if(trace.columns(), &Trace::Column::overrun), 1);
}

TEST(Trace, RefusesToBeNothingWide) {
  EXPECT_THROW(trace_of(0), std::invalid_argument);
  EXPECT_THROW(trace_of(1, Duration::zero()), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::lab::trace_test
