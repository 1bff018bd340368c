// SPDX-License-Identifier: Apache-2.0
#include "server/clients/lateness.h"

#include <gtest/gtest.h>

#include "protocol/limits.h"

namespace tendon::lateness_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// The engine answers at 100 Hz. The round trip is 40 ms, and a force is valid for 30 ms.
class Engine {
 public:
  explicit Engine(bool same_machine = false) { lateness.begin(now_, same_machine); }

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

TEST(Lateness, AForceThatIsStillMissingIsTheEnginesFaultWhileItIsHeard) {
  Engine busy;
  busy.answer_times(50);
  busy.lateness.heard(busy.now() + milliseconds(950), std::nullopt, 0);
  const auto report = busy.lateness.report(busy.now() + seconds(1));
  EXPECT_EQ(report.late_engine, 1U);
  EXPECT_EQ(report.text,
            "forces were late once, by up to 970 ms: the engine (its datagrams arrive, but without a usable force)");
}

TEST(Lateness, OnlyTheSilenceOfALocalEngineIsItsFault) {
  for (const bool local : {false, true}) {
    Engine silent(local);
    silent.answer_times(50);
    const auto report = silent.lateness.report(silent.now() + seconds(1));
    EXPECT_EQ(local ? report.late_engine : report.late_unknown, 1U);
    EXPECT_EQ(report.late(), 1U);
    EXPECT_EQ(report.text, std::string("forces were late once, by up to 970 ms: the engine ") +
                               (local ? "(no datagrams arrive from its program on this machine)"
                                      : "has stopped, or the network is down (no datagrams arrive)"));
  }
}

/// There is a gap of `apart` between two time stamps, which is followed by a force with a long round trip.
Lateness::Report after_silence(Duration apart, std::uint64_t lost) {
  Engine engine;
  engine.answer_times(200);
  const PeerTime before(seconds(77));
  engine.lateness.heard(engine.now(), before, 0);
  engine.lateness.heard(engine.now() + milliseconds(600), before + apart, lost);
  engine.answer({}, milliseconds(590));
  return engine.lateness.report(engine.now());
}

TEST(Lateness, AProgramThatStoodStillIsBlamedWhateverTheRoundTripSays) {
  const auto report = after_silence(milliseconds(598), 0);
  EXPECT_EQ(report.late_engine, 1U);
  EXPECT_EQ(report.text, "forces were late once, by up to 570 ms: the engine (its program was stopped for 598 ms)");
}

TEST(Lateness, ASilenceWithLossesOrTooShortAStandstillIsOfTheNetwork) {
  EXPECT_EQ(after_silence(milliseconds(598), 3).late_network, 1U) << "datagrams were lost";
  EXPECT_EQ(after_silence(milliseconds(150), 0).late_network, 1U) << "explains little of the delay";
}

/// The forces are in time, with a state in each millisecond. After that, our own process is stopped for `pause`.
Engine stopped(Duration pause, bool same_machine) {
  Engine engine(same_machine);
  for (int i = 0; i < 200; ++i) {
    engine.answer();
    for (int ms = 9; ms >= 0; --ms) engine.lateness.took_state(engine.now() - milliseconds(ms));
  }
  engine.pause(pause);
  return engine;
}

TEST(Lateness, APauseOfTheServerIsItsOwnWhateverTheRoundTripSays) {
  for (const bool same_machine : {false, true}) {
    Engine engine = stopped(milliseconds(190), same_machine);
    engine.lateness.heard(engine.now(), PeerTime(seconds(7)), 0);
    engine.answer({}, milliseconds(190));  // waited in our socket
    const auto report = engine.lateness.report(engine.now());
    EXPECT_EQ(report.late_ours, 1U);
    EXPECT_EQ(report.late(), 1U);
    EXPECT_EQ(report.text.substr(report.text.find(": ")), ": the server (its threads were stopped for 390 ms)");
  }
}

TEST(Lateness, APauseOfTheDevicesLoopAloneIsTheServersToo) {
  Engine engine = stopped(milliseconds(190), true);
  engine.lateness.took_state(engine.now());  // first state after the pause, answered quickly
  engine.answer();
  const auto report = engine.lateness.report(engine.now());
  EXPECT_EQ(report.late_ours, 1U);
  EXPECT_EQ(report.text, "forces were late once, by up to 170 ms: the server (its threads were stopped for 190 ms)");
}

TEST(Lateness, AForceThatIsMissingWhileStatesAreIsTheServersFault) {
  for (const bool same_machine : {false, true}) {
    Engine engine = stopped(seconds(2), same_machine);
    const auto report = engine.lateness.report(engine.now());
    EXPECT_EQ(report.late_ours, 1U);
    EXPECT_EQ(report.late(), 1U);
  }
}

TEST(Lateness, APauseThatExplainsLittleOfTheDelayIsNotBlamed) {
  Engine engine = stopped(milliseconds(40), false);
  for (int ms = 0; ms < 160; ++ms) engine.lateness.took_state(engine.now() + milliseconds(ms));
  engine.answer({}, milliseconds(160));
  EXPECT_EQ(engine.lateness.report(engine.now()).late_network, 1U);
}

TEST(Lateness, RefusedForcesAreNamedEvenWhenNoneEverCame) {
  Engine engine;
  engine.lateness.refused(Lateness::Cause::kNotFinite, 3);
  const auto report = engine.lateness.report(engine.now() + seconds(1));
  EXPECT_EQ(report.late(), 0U);
  EXPECT_EQ(report.text, "forces were refused 3 times: the engine (its forces are not finite)");
  EXPECT_EQ(engine.lateness.report(engine.now() + seconds(2)).text, "");
}

TEST(Lateness, ForcesThatTheDeviceCutsAreToldToTheEngineNotToTheOperator) {
  Engine engine;
  engine.answer_times(10);
  for (int i = 0; i < 3; ++i) engine.lateness.cut();
  const auto report = engine.lateness.report(engine.now());
  EXPECT_EQ(report.text, "");
  EXPECT_EQ(report.advice, "3 forces were above the device's bound and reduced to it");
}

TEST(Lateness, TheReportOfTwoChannelsCountsBoth) {
  Engine one;
  one.lateness.refused(Lateness::Cause::kOutOfBounds, 2);
  one.lateness.cut();
  Engine other;
  other.lateness.refused(Lateness::Cause::kOutOfBounds, 3);
  auto sum = one.lateness.report(one.now());
  sum.add(other.lateness.report(other.now()));
  EXPECT_EQ(sum.advice,
            "forces were refused 5 times: the engine (its forces exceed the bounds in WIRE.md); 1 force was above the "
            "device's bound and reduced to it");
}

TEST(Lateness, WordsFitIntoTheirFieldOnTheWire) {
  for (int cause = 1; cause <= static_cast<int>(Lateness::Cause::kOldSequence); ++cause) {
    Engine engine;
    engine.answer_times(2);
    engine.lateness.refused(static_cast<Lateness::Cause>(cause), UINT64_MAX);
    engine.lateness.heard(engine.now() + std::chrono::hours(24), std::nullopt, 0);
    EXPECT_LE(engine.lateness.report(engine.now() + std::chrono::hours(24)).text.size(), limits::kMaxDetail) << cause;
  }
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
            "forces were late once, by up to 65 ms: the engine (its datagrams arrive, but without a usable force)");
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
}  // namespace tendon::lateness_test
