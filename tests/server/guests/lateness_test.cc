// SPDX-License-Identifier: Apache-2.0
#include "server/guests/lateness.h"

#include <gtest/gtest.h>

namespace tendon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr bool kElsewhere = false;
constexpr bool kHere = true;

/// An engine at 100 Hz behind a round trip of 40 ms, whose forces are valid for 30 ms.
class Engine {
 public:
  Engine() { lateness.begin(now_); }

  /// The next force; the parts are longer than usual by so much.
  void answer(Duration ours = {}, Duration network = {}, Duration engine = {}, bool lost = false) {
    now_ += milliseconds(10) + ours + network + engine;
    const LocalTime sampled = now_ - milliseconds(46) - ours - network - engine;
    lateness.observe({.sampled = sampled,
                      .sent = sampled + milliseconds(1) + ours,
                      .received = now_,
                      .round_trip = milliseconds(40) + network,
                      .valid_for = milliseconds(30),
                      .lost = lost});
  }
  void pause(Duration length) { now_ += length; }
  void answer_times(int n) {
    for (int i = 0; i < n; ++i) answer();
  }
  LocalTime now() const { return now_; }

 private:
  LocalTime now_{seconds(1)};

 public:
  Lateness lateness;
};

TEST(Lateness, SaysNothingWhenForcesComeInTime) {
  Engine engine;
  engine.answer_times(200);
  const auto report = engine.lateness.report(engine.now(), kElsewhere);
  EXPECT_EQ(report.forces, 200U);
  EXPECT_EQ(report.late(), 0U);
  EXPECT_EQ(report.text, "");
}

TEST(Lateness, BlamesThePartThatIsLongerThanUsualByMost) {
  Engine engine;
  engine.answer_times(200);
  engine.answer({}, milliseconds(90), milliseconds(5));
  auto report = engine.lateness.report(engine.now(), kElsewhere);
  EXPECT_EQ(report.late_network, 1U);
  EXPECT_EQ(report.late(), 1U);
  EXPECT_EQ(report.worst, milliseconds(75));
  EXPECT_EQ(report.cause, Lateness::Cause::kRoundTrip);
  EXPECT_EQ(report.text, "forces were late once, by up to 75 ms: the network (round trip 130 ms, usually 40 ms)");

  engine.answer_times(10);
  engine.answer({}, milliseconds(5), milliseconds(90));
  engine.answer({}, {}, milliseconds(40));
  report = engine.lateness.report(engine.now(), kElsewhere);
  EXPECT_EQ(report.cause, Lateness::Cause::kEngineTook);
  EXPECT_EQ(report.late_engine, 2U);
  EXPECT_EQ(report.text, "forces were late 2 times, by up to 75 ms: the engine (it took 95 ms, usually 5.0 ms)");

  engine.answer_times(10);
  engine.answer(milliseconds(50), {}, {});
  report = engine.lateness.report(engine.now(), kElsewhere);
  EXPECT_EQ(report.cause, Lateness::Cause::kStateWaited);
  EXPECT_EQ(report.late_ours, 1U);
  EXPECT_EQ(report.late(), 1U);
  EXPECT_EQ(report.text,
            "forces were late once, by up to 30 ms: the server's threads (a state waited 51 ms, usually 1.0 ms)");
}

TEST(Lateness, SilenceFromElsewhereIsTheNetworksFaultAndElseTheEngines) {
  Engine silent;
  silent.answer_times(50);
  EXPECT_EQ(silent.lateness.report(silent.now() + seconds(1), kElsewhere).text,
            "forces were late once, by up to 970 ms: the network (nothing is heard of the engine's machine)");

  Engine busy;
  busy.answer_times(50);
  busy.lateness.heard(busy.now() + milliseconds(950));
  EXPECT_EQ(busy.lateness.report(busy.now() + seconds(1), kElsewhere).text,
            "forces were late once, by up to 970 ms: the engine (it is heard, but sends no force)");
}

TEST(Lateness, AQuickForceAfterAGapMeansThatOneBeforeItWasLostOrNeverSent) {
  Engine engine;
  engine.answer_times(200);
  engine.pause(milliseconds(80));
  engine.answer({}, milliseconds(2), milliseconds(3), true);
  EXPECT_EQ(engine.lateness.report(engine.now(), kElsewhere).text,
            "forces were late once, by up to 65 ms: the network (datagrams were lost)");
  engine.answer_times(10);
  engine.pause(milliseconds(80));
  engine.answer({}, milliseconds(2), milliseconds(3), false);
  EXPECT_EQ(engine.lateness.report(engine.now(), kElsewhere).text,
            "forces were late once, by up to 65 ms: the engine (it is heard, but sends no force)");
}

TEST(Lateness, NobodyIsLateBeforeTheFirstForceOrWithoutAController) {
  Engine engine;
  EXPECT_EQ(engine.lateness.report(engine.now() + seconds(9), kElsewhere).late(), 0U);
  engine.answer_times(5);
  engine.lateness.end();
  engine.lateness.report(engine.now(), kElsewhere);
  EXPECT_EQ(engine.lateness.report(engine.now() + seconds(9), kElsewhere).late(), 0U);
}

TEST(Lateness, OneLateForceDoesNotChangeWhatIsUsual) {
  Engine engine;
  engine.answer_times(200);
  for (int i = 0; i < 5; ++i) engine.answer({}, seconds(1), {});
  EXPECT_EQ(engine.lateness.report(engine.now(), kElsewhere).usual_network, milliseconds(40));
}

TEST(Lateness, SilenceOnThisMachineIsNeverTheNetworksFault) {
  Engine asleep;
  asleep.answer_times(50);
  const auto report = asleep.lateness.report(asleep.now() + milliseconds(2500), kHere);
  EXPECT_EQ(report.late_engine, 1U);
  EXPECT_EQ(report.late_network, 0U);
  EXPECT_EQ(report.text,
            "forces were late once, by up to 2470 ms: the engine (it is on this machine and sends nothing: it blocks, "
            "sleeps or has died)");
}

TEST(Lateness, AnEngineWhoseForcesAreRefusedIsToBlameAndIsToldWhy) {
  Engine engine;
  engine.answer_times(50);
  engine.lateness.refuse(Lateness::Refused::kValue, 100);
  engine.lateness.heard(engine.now() + milliseconds(990));
  auto report = engine.lateness.report(engine.now() + seconds(1), kHere);
  EXPECT_EQ(report.cause, Lateness::Cause::kEngineRefused);
  EXPECT_EQ(report.text,
            "forces were late once, by up to 970 ms: the engine (its forces are refused); 100 forces were refused: not "
            "finite, or out of bounds");

  engine.answer_times(50);
  engine.lateness.refuse(Lateness::Refused::kTick);
  report = engine.lateness.report(engine.now(), kElsewhere);
  EXPECT_EQ(report.text, "1 force was refused: the tick answered never was, or is too old")
      << "also where no force was late";
}

TEST(Lateness, ForcesThatTheDeviceCutsAreToldToTheEngineNotToTheOperator) {
  Engine engine;
  engine.answer_times(10);
  for (int i = 0; i < 3; ++i) engine.lateness.cut();
  const auto report = engine.lateness.report(engine.now(), kElsewhere);
  EXPECT_EQ(report.text, "");
  EXPECT_EQ(report.advice, "3 forces were above the device's bound, and cut to it");
}

TEST(Lateness, TheReportOfTwoChannelsCountsBoth) {
  Engine one;
  one.lateness.refuse(Lateness::Refused::kValue, 2);
  Engine other;
  other.lateness.refuse(Lateness::Refused::kValue, 3);
  auto sum = one.lateness.report(one.now(), kElsewhere);
  sum.add(other.lateness.report(other.now(), kElsewhere));
  EXPECT_EQ(sum.advice, "5 forces were refused: not finite, or out of bounds");
}

}  // namespace
}  // namespace tendon
