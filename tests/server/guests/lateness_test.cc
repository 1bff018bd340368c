// SPDX-License-Identifier: Apache-2.0
#include "server/guests/lateness.h"

#include <gtest/gtest.h>

namespace tendon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

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
  const auto report = engine.lateness.report(engine.now());
  EXPECT_EQ(report.forces, 200U);
  EXPECT_EQ(report.late(), 0U);
  EXPECT_EQ(report.text, "");
}

TEST(Lateness, BlamesThePartThatIsLongerThanUsualByMost) {
  Engine engine;
  engine.answer_times(200);
  engine.answer({}, milliseconds(90), milliseconds(5));
  auto report = engine.lateness.report(engine.now());
  EXPECT_EQ(report.late_network, 1U);
  EXPECT_EQ(report.late(), 1U);
  EXPECT_EQ(report.worst, milliseconds(75));
  EXPECT_EQ(report.cause, Lateness::Cause::kRoundTrip);
  EXPECT_EQ(report.text, "forces were late once, by up to 75 ms: the network (round trip 130 ms, usually 40 ms)");

  engine.answer_times(10);
  engine.answer({}, milliseconds(5), milliseconds(90));
  engine.answer({}, {}, milliseconds(40));
  report = engine.lateness.report(engine.now());
  EXPECT_EQ(report.cause, Lateness::Cause::kEngineTook);
  EXPECT_EQ(report.late_engine, 2U);
  EXPECT_EQ(report.text, "forces were late 2 times, by up to 75 ms: the engine (it took 95 ms, usually 5.0 ms)");

  engine.answer_times(10);
  engine.answer(milliseconds(50), {}, {});
  report = engine.lateness.report(engine.now());
  EXPECT_EQ(report.cause, Lateness::Cause::kStateWaited);
  EXPECT_EQ(report.late_ours, 1U);
  EXPECT_EQ(report.late(), 1U);
  EXPECT_EQ(report.text,
            "forces were late once, by up to 30 ms: the server's threads (a state waited 51 ms, usually 1.0 ms)");
}

TEST(Lateness, AForceThatIsStillMissingIsTheNetworksFaultWhenNothingIsHeardAndElseTheEngines) {
  Engine silent;
  silent.answer_times(50);
  EXPECT_EQ(silent.lateness.report(silent.now() + seconds(1)).text,
            "forces were late once, by up to 970 ms: the network (nothing is heard of the engine's machine)");

  Engine busy;
  busy.answer_times(50);
  busy.lateness.heard(busy.now() + milliseconds(950));
  EXPECT_EQ(busy.lateness.report(busy.now() + seconds(1)).text,
            "forces were late once, by up to 970 ms: the engine (it is heard, but sends no force)");
}

TEST(Lateness, AQuickForceAfterAGapMeansThatOneBeforeItWasLostOrNeverSent) {
  Engine engine;
  engine.answer_times(200);
  engine.pause(milliseconds(80));
  engine.answer({}, milliseconds(2), milliseconds(3), true);
  EXPECT_EQ(engine.lateness.report(engine.now()).text,
            "forces were late once, by up to 65 ms: the network (datagrams were lost)");
  engine.answer_times(10);
  engine.pause(milliseconds(80));
  engine.answer({}, milliseconds(2), milliseconds(3), false);
  EXPECT_EQ(engine.lateness.report(engine.now()).text,
            "forces were late once, by up to 65 ms: the engine (it is heard, but sends no force)");
}

TEST(Lateness, NobodyIsLateBeforeTheFirstForceOrWithoutAController) {
  Engine engine;
  EXPECT_EQ(engine.lateness.report(engine.now() + seconds(9)).late(), 0U);
  engine.answer_times(5);
  engine.lateness.end();
  engine.lateness.report(engine.now());
  EXPECT_EQ(engine.lateness.report(engine.now() + seconds(9)).late(), 0U);
}

TEST(Lateness, OneLateForceDoesNotChangeWhatIsUsual) {
  Engine engine;
  engine.answer_times(200);
  for (int i = 0; i < 5; ++i) engine.answer({}, seconds(1), {});
  EXPECT_EQ(engine.lateness.report(engine.now()).usual_network, milliseconds(40));
}

}  // namespace
}  // namespace tendon
