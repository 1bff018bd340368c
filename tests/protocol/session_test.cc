// SPDX-License-Identifier: Apache-2.0
#include "protocol/session.h"

#include <gtest/gtest.h>

#include <random>

#include "protocol/limits.h"
#include "protocol/reliable/round_trip.h"
#include "protocol/wire/codec.h"
#include "tests/protocol/two_ends.h"

namespace tendon::session_test {
namespace {

TEST_F(TwoEnds, AForceAndAStateArriveAsTheyWereSent) {
  a_.send(force(7));
  z_.send(state(8));
  deliver(z_, now_, pull(a_, now_));
  deliver(a_, now_, pull(z_, now_));
  const auto at_z = events(z_);
  const auto at_a = events(a_);
  ASSERT_EQ(at_z.size(), 1U);
  EXPECT_EQ(std::get<Session::ForceArrived>(at_z[0]).command.sequence, 7U);
  EXPECT_EQ(std::get<Session::ForceArrived>(at_z[0]).command.force, examples::force().force);
  ASSERT_EQ(at_a.size(), 1U);
  EXPECT_EQ(std::get<Session::StateArrived>(at_a[0]).state.tick, 8U);
}

TEST_F(TwoEnds, WhatHasNotLeftYetIsReplacedByTheNewer) {
  for (std::uint64_t n = 1; n <= 1000; ++n) a_.send(force(n));
  deliver(z_, now_, pull(a_, now_));
  EXPECT_EQ(only<Session::ForceArrived>(z_).command.sequence, 1000U);
  EXPECT_EQ(a_.stats().datagrams_sent, 1U);
}

TEST_F(TwoEnds, WhatWasNotTakenOutYetIsReplacedByTheNewer) {
  for (std::uint64_t n = 1; n <= 1000; ++n) {
    a_.send(force(n));
    z_.send(state(n));
    deliver(z_, now_, pull(a_, now_));
    deliver(a_, now_, pull(z_, now_));
  }
  EXPECT_EQ(events(z_).size(), 1U);
  EXPECT_EQ(events(a_).size(), 1U);
}

TEST_F(TwoEnds, TheNewestWinsForEachDeviceAndChannelByItself) {
  const auto to = [](std::uint64_t sequence, std::uint32_t device, std::uint32_t channel) {
    ForceCommand command = force(sequence);
    command.device = device;
    command.channel = channel;
    return command;
  };
  a_.send(to(5, 0, 0));
  a_.send(to(3, 1, 0));
  a_.send(to(2, 0, 1));
  a_.send(to(6, 0, 0));
  deliver(z_, now_, pull(a_, now_));
  a_.send(to(4, 1, 0));
  a_.send(to(2, 0, 1));
  deliver(z_, now_, pull(a_, now_));
  std::vector<std::array<std::uint64_t, 3>> arrived;
  for (const auto& event : events(z_)) {
    const ForceCommand& command = std::get<Session::ForceArrived>(event).command;
    arrived.push_back({command.sequence, command.device, command.channel});
  }
  EXPECT_EQ(arrived, (std::vector<std::array<std::uint64_t, 3>>{{6, 0, 0}, {4, 1, 0}, {2, 0, 1}}));
  EXPECT_EQ(z_.stats().stale, 1U) << "2 came twice to device 0, channel 1";
}

TEST_F(TwoEnds, StatesOfSixteenDevicesShareThreeDatagrams) {
  for (std::uint32_t device = 0; device < limits::kMaxDevices; ++device) {
    DeviceState full = examples::state();
    full.tick = std::uint64_t{1} << 40;
    full.position = full.velocity = full.force_applied = Vec3(0.1, 0.2, 0.3);
    full.force_sequence = full.tick;
    full.device = device;
    z_.send(full);
  }
  const auto datagrams = pull(z_, now_);
  EXPECT_EQ(datagrams.size(), 3U);
  deliver(a_, now_, datagrams);
  const auto told = events(a_);
  ASSERT_EQ(told.size(), limits::kMaxDevices);
  for (std::uint32_t device = 0; device < limits::kMaxDevices; ++device) {
    EXPECT_EQ(std::get<Session::StateArrived>(told[device]).state.device, device);
  }
}

Session in_columns() {
  Session::Config columns = config();
  columns.states_in_columns = true;
  return Session(columns, kOpened);
}

std::vector<DeviceState> moving(std::uint64_t tick) {
  std::vector<DeviceState> states(limits::kMaxDevices, state(tick));
  for (std::uint32_t device = 0; device < states.size(); ++device) {
    states[device].device = device;
    states[device].position = Vec3(0.1, 0.2, 0.3) / (device + 3);
    states[device].velocity = Vec3(0.1, 0.2, 0.3) / (device + 7);
    states[device].force_applied = Vec3(1, 2, 3) / (device + 7);
  }
  return states;
}

TEST_F(TwoEnds, InColumnsSixteenStatesShareOneDatagramAndRoundAsTheySay) {
  Session server = in_columns();
  std::vector<DeviceState> sent = moving(8);
  for (std::size_t i = sent.size(); i > 0; --i) server.send(sent[i - 1]);  // in any order
  const auto datagrams = pull(server, now_);
  EXPECT_EQ(datagrams.size(), 1U);
  deliver(a_, now_, datagrams);
  const auto told = events(a_);
  ASSERT_EQ(told.size(), sent.size());
  for (std::size_t i = 0; i < told.size(); ++i) {
    const DeviceState& got = std::get<Session::StateArrived>(told[i]).state;
    round_to_columns(sent[i]);
    EXPECT_EQ(got.device, i);
    EXPECT_EQ(got.position, sent[i].position);
    EXPECT_EQ(got.velocity, sent[i].velocity);
    EXPECT_EQ(got.force_applied, sent[i].force_applied);
  }
  EXPECT_EQ(a_.stats().invalid, 0U);
}

TEST_F(TwoEnds, ColumnsOfTwoInstantsAreTwoFramesAndAHandleThatTurnsIsNone) {
  Session server = in_columns();
  std::vector<DeviceState> sent = moving(8);
  sent.resize(4);
  sent[1].tick = 9;
  sent[2].sampled += milliseconds(1);
  sent[3].turning = Turning{};
  for (const DeviceState& state : sent) server.send(state);
  DataReader reader;
  const auto datagrams = pull(server, now_);
  ASSERT_EQ(datagrams.size(), 1U);
  deliver(a_, now_, datagrams);
  std::array<DeviceState, 4> got;
  for (const auto& event : events(a_)) {
    const DeviceState& state = std::get<Session::StateArrived>(event).state;
    got.at(state.device) = state;
  }
  for (std::size_t i = 0; i < got.size(); ++i) {
    EXPECT_EQ(got[i].tick, sent[i].tick) << i;
    EXPECT_EQ(got[i].sampled, sent[i].sampled) << i;
    EXPECT_EQ(got[i].turning, sent[i].turning) << i;
    EXPECT_EQ(got[i].velocity == sent[i].velocity, i == 3) << i << ": whole states lose nothing";
  }
}

TEST_F(TwoEnds, WhatDoesNotFitTheColumnsOfOneDatagramIsInTheNext) {
  Session server = in_columns();
  std::vector<DeviceState> sent = moving(8);
  for (DeviceState& state : sent) {
    state.force_sequence = std::uint64_t{1} << 60U;
    state.reasons = 1U << 31U;
    server.send(state);
  }
  const auto datagrams = pull(server, now_);
  EXPECT_EQ(datagrams.size(), 2U);
  deliver(a_, now_, datagrams);
  EXPECT_EQ(events(a_).size(), sent.size());
  EXPECT_EQ(a_.stats().stale + a_.stats().invalid, 0U);
}

TEST_F(TwoEnds, AnOlderForceOrStateThatComesLateIsDroppedAndCounted) {
  a_.send(force(1));
  const auto old_force = pull(a_, now_);
  a_.send(force(2));
  deliver(z_, now_, pull(a_, now_));
  deliver(z_, now_, old_force);
  EXPECT_EQ(only<Session::ForceArrived>(z_).command.sequence, 2U);
  EXPECT_EQ(z_.stats().stale, 1U);
  EXPECT_EQ(z_.stats().reordered, 1U);

  a_.send(force(2));  // not newer
  deliver(z_, now_, pull(a_, now_));
  EXPECT_TRUE(events(z_).empty());
  EXPECT_EQ(z_.stats().stale, 2U);
}

TEST_F(TwoEnds, AReportIsNewestWinsAsWellAndGoesBesideAState) {
  LinkReport report = examples::report();
  z_.send(report);
  report.number = 4;
  z_.send(report);
  z_.send(state(8));
  const auto both = pull(z_, now_);
  EXPECT_EQ(both.size(), 1U);
  deliver(a_, now_, both);
  const auto at_a = events(a_);
  ASSERT_EQ(at_a.size(), 2U);
  EXPECT_EQ(std::get<Session::ReportArrived>(at_a[0]).report.number, 4U);
  EXPECT_EQ(std::get<Session::ReportArrived>(at_a[0]).report.words, report.words);

  report.number = 3;  // older
  z_.send(report);
  deliver(a_, now_, pull(z_, now_));
  EXPECT_TRUE(events(a_).empty());
  EXPECT_EQ(a_.stats().stale, 1U);
}

TEST_F(TwoEnds, ReportsOnDevicesAndEnginesAreNewestWinsEachForItself) {
  const auto of_device = [](std::uint32_t device, std::uint64_t number) {
    DeviceReport report = examples::device_report();
    report.device = device;
    report.number = number;
    return report;
  };
  const auto of_channel = [](std::uint32_t channel, std::uint64_t number) {
    PeerReport report = examples::peer_report();
    report.channel = channel;
    report.link.number = number;
    return report;
  };
  z_.send(of_device(0, 1));
  z_.send(of_device(1, 1));
  z_.send(of_device(0, 2));
  z_.send(of_channel(0, 1));
  z_.send(of_channel(1, 5));
  deliver(a_, now_, pull(z_, now_));
  const auto at_a = events(a_);
  ASSERT_EQ(at_a.size(), 4U);
  EXPECT_EQ(std::get<Session::DeviceReportArrived>(at_a[0]).report.number, 2U);
  EXPECT_EQ(std::get<Session::DeviceReportArrived>(at_a[1]).report.device, 1U);
  EXPECT_EQ(std::get<Session::PeerReportArrived>(at_a[2]).report.channel, 0U);
  EXPECT_EQ(std::get<Session::PeerReportArrived>(at_a[3]).report.link.number, 5U);
  EXPECT_EQ(a_.stats().stale, 0U);

  z_.send(of_device(0, 2));
  z_.send(of_channel(1, 4));
  z_.send(of_channel(0, 4));  // the newest force of its channel
  deliver(a_, now_, pull(z_, now_));
  EXPECT_EQ(only<Session::PeerReportArrived>(a_).report.channel, 0U);
  EXPECT_EQ(a_.stats().stale, 2U);
}

TEST_F(TwoEnds, OfPortsTheHighestSequenceOfTheHighestEpochWins) {
  const auto port = [](std::uint32_t channel, std::uint64_t epoch, std::uint64_t sequence) {
    PortFrame made = examples::port();
    made.channel = channel;
    made.epoch = epoch;
    made.sequence = sequence;
    return made;
  };
  z_.send(port(0, 5, 8));
  z_.send(port(1, 2, 3));
  z_.send(port(0, 5, 9));  // replaces the first, which was not sent yet
  z_.send(state(8));
  const auto together = pull(z_, now_);
  EXPECT_EQ(together.size(), 1U) << "ports go beside states";
  deliver(a_, now_, together);
  const auto at_a = events(a_);
  ASSERT_EQ(at_a.size(), 3U);
  EXPECT_EQ(std::get<Session::PortArrived>(at_a[0]).port.sequence, 9U);
  EXPECT_EQ(std::get<Session::PortArrived>(at_a[1]).port.channel, 1U);
  EXPECT_EQ(a_.stats().stale, 0U);

  for (const auto& old : {port(0, 5, 9), port(0, 5, 8), port(0, 4, 100)}) {
    z_.send(old);
    deliver(a_, now_, pull(z_, now_));
  }
  EXPECT_TRUE(events(a_).empty());
  EXPECT_EQ(a_.stats().stale, 3U);

  z_.send(port(0, 6, 1));  // restarted
  deliver(a_, now_, pull(z_, now_));
  EXPECT_EQ(only<Session::PortArrived>(a_).port.epoch, 6U);
}

TEST_F(TwoEnds, TheTwoEndsOfACouplingAreStreamsOfTheirOwn) {
  const auto port = [](bool of_peer, std::uint64_t epoch) {
    PortFrame made = examples::port();
    made.of_peer = of_peer;
    made.epoch = epoch;
    return made;
  };
  z_.send(port(true, 9));
  z_.send(port(false, 5));  // both of them are sent
  deliver(a_, now_, pull(z_, now_));
  const auto at_a = events(a_);
  ASSERT_EQ(at_a.size(), 2U);
  EXPECT_TRUE(std::get<Session::PortArrived>(at_a[0]).port.of_peer);
  EXPECT_EQ(std::get<Session::PortArrived>(at_a[0]).port.epoch, 9U);
  EXPECT_FALSE(std::get<Session::PortArrived>(at_a[1]).port.of_peer);
  EXPECT_EQ(std::get<Session::PortArrived>(at_a[1]).port.epoch, 5U);
  EXPECT_EQ(a_.stats().stale, 0U) << "… nor makes it old where it comes in";
}

TEST_F(TwoEnds, PortsGoEitherWayAndOfThoseNotTakenOutTheNewestIsLeft) {
  PortFrame port = examples::port();
  a_.send(port);
  deliver(z_, now_, pull(a_, now_));
  ++port.sequence;
  a_.send(port);
  deliver(z_, now_, pull(a_, now_));
  const auto at_z = events(z_);
  ASSERT_EQ(at_z.size(), 1U);
  EXPECT_EQ(std::get<Session::PortArrived>(at_z[0]).port.sequence, port.sequence);
}

TEST_F(TwoEnds, CouplingsAreAskedForAndAnsweredInOrder) {
  ASSERT_TRUE(a_.request(examples::couple()));
  ASSERT_TRUE(a_.request(Engage{.device = 1}));
  ASSERT_TRUE(a_.request(Disengage{.device = 1}));
  ASSERT_TRUE(a_.request(examples::set_scale()));
  ASSERT_TRUE(a_.request(examples::set_share()));
  deliver(z_, now_, pull(a_, now_));
  const auto at_z = events(z_);
  ASSERT_EQ(at_z.size(), 5U);
  const auto asked = [&](std::size_t i) { return std::get<Session::RequestArrived>(at_z[i]).request; };
  EXPECT_EQ(std::get<Couple>(asked(0)), examples::couple());
  EXPECT_EQ(std::get<Engage>(asked(1)).device, 1U);
  EXPECT_EQ(std::get<Disengage>(asked(2)).device, 1U);
  EXPECT_EQ(std::get<SetScale>(asked(3)).force_scale, 4);
  EXPECT_EQ(std::get<SetShare>(asked(4)).share, 0.75);
}

TEST_F(TwoEnds, ReportsOfAllDevicesAndChannelsLeaveInAsManyDatagramsAsTheyNeed) {
  for (std::uint32_t device = 0; device < limits::kMaxDevices; ++device) {
    DeviceReport report = examples::device_report();
    report.device = device;
    z_.send(report);
    for (std::uint32_t channel = 0; channel < limits::kMaxChannels; ++channel) {
      PeerReport peer = examples::peer_report();
      peer.device = device;
      peer.channel = channel;
      z_.send(peer);
    }
  }
  const auto datagrams = pull(z_, now_);
  EXPECT_GT(datagrams.size(), 1U);
  deliver(a_, now_, datagrams);
  EXPECT_EQ(events(a_).size(), limits::kMaxDevices * (1 + limits::kMaxChannels));
  EXPECT_TRUE(pull(z_, now_).empty());
}

TEST_F(TwoEnds, TheRoundTripDoesNotCountTheTimeThatThePeerTook) {
  const auto there = pull(a_, now_);  // T1
  now_ += milliseconds(3);
  deliver(z_, now_, there);  // T2
  pull(z_, now_);            // lost
  now_ += milliseconds(500);
  const auto back = pull(z_, now_);  // T3
  now_ += milliseconds(4);
  deliver(a_, now_, back);  // T4
  EXPECT_EQ(a_.stats().round_trip, milliseconds(7));
  EXPECT_EQ(a_.stats().smoothed_round_trip, milliseconds(7));
  EXPECT_EQ(a_.stats().round_trip_variation, std::chrono::microseconds(3500));
}

TEST_F(TwoEnds, TheRoundTripDoesNotCountTheTimeInWhichDatagramsWaited) {
  const auto there = pull(a_, now_);  // T1
  now_ += milliseconds(3);
  const LocalTime reached_z = now_;  // T2
  now_ += milliseconds(20);
  for (const Bytes& datagram : there) z_.receive(now_, datagram, reached_z);
  const auto back = pull(z_, now_);  // T3
  now_ += milliseconds(4);
  const LocalTime reached_a = now_;  // T4
  now_ += milliseconds(30);
  for (const Bytes& datagram : back) a_.receive(now_, datagram, reached_a);
  EXPECT_EQ(a_.stats().round_trip, milliseconds(7));
  ASSERT_TRUE(a_.exchange());
  EXPECT_EQ(a_.exchange()->answered_at, reached_a);
}

TEST_F(TwoEnds, AStampFromBeforeTheQuestionIsNotUsed) {
  now_ += milliseconds(50);
  deliver(z_, now_, pull(a_, now_));
  z_.send(state(1));
  const auto back = pull(z_, now_);
  const LocalTime asked = now_;
  now_ += milliseconds(4);
  for (const Bytes& datagram : back) a_.receive(now_, datagram, asked - Duration{1});
  EXPECT_EQ(a_.stats().round_trip, milliseconds(4));
  EXPECT_EQ(a_.stats().invalid, 0U);
}

/// Returns A's estimate of Z's clock, which is 3 s ahead, after 30 exchanges. The delay of the network is 5 µs, and each
/// thread needs 10 to 200 µs to wake up.
ClockOffsetEstimator::Estimate clock_of_z(bool stamps) {
  constexpr Duration kAhead = seconds(3);
  constexpr Duration kWay = std::chrono::microseconds(5);
  Session a(config(), kOpened);
  Session z(config(), kOpened);
  std::mt19937_64 dice(1);
  const auto wake_up = [&dice] { return std::chrono::microseconds(10 + static_cast<int>(dice() % 191)); };
  const auto pass = [&](Session& to, LocalTime sent, Duration ahead, const std::vector<Bytes>& datagrams) {
    const LocalTime reached = sent + kWay;
    const LocalTime read = reached + wake_up();
    for (const Bytes& datagram : datagrams) to.receive(read + ahead, datagram, (stamps ? reached : read) + ahead);
    return read;
  };
  LocalTime now = kOpened;
  for (std::uint64_t n = 1; n <= 30; ++n) {
    a.send(force(n));
    const LocalTime asked = pass(z, now, kAhead, pull(a, now));
    z.send(state(n));
    now = pass(a, asked, Duration{}, pull(z, asked + kAhead));
  }
  EXPECT_TRUE(a.peer_clock());
  ClockOffsetEstimator::Estimate estimate = a.peer_clock().value_or(ClockOffsetEstimator::Estimate{});
  estimate.offset -= kAhead;
  return estimate;
}

TEST(SessionClock, StampsKeepTheWakeUpsOfTheThreadsOutOfTheOffset) {
  const auto with = clock_of_z(true);
  const auto without = clock_of_z(false);
  EXPECT_EQ(with.least_round_trip, std::chrono::microseconds(10));
  EXPECT_GE(without.least_round_trip, std::chrono::microseconds(30));
  EXPECT_LE(std::chrono::abs(with.offset), Duration(10));
  EXPECT_GE(std::chrono::abs(without.offset), std::chrono::microseconds(1));
  EXPECT_LE(2 * with.error_bound, without.error_bound);
}

TEST_F(TwoEnds, AnImpossibleEchoIsCountedAndTheRestIsRead) {
  pull(a_, now_);  // packet 0
  const auto echoing = [](Duration sent, Duration received, std::uint64_t number) {
    return OutgoingEcho{.sent = PeerTime{sent}, .received = LocalTime{received}, .packet_number = number};
  };
  const Duration opened = kOpened.time_since_epoch();
  const Duration written = milliseconds(1000);  // examples::data writes at 1000.1 ms of the peer's clock
  const OutgoingEcho impossible[] = {
      echoing(opened, written, 1),                    // this packet has not been sent by A
      echoing(opened - Duration{1}, written, 0),      // sent before the session
      echoing(opened + Duration{1}, written, 0),      // sent in the future
      echoing(opened, written + milliseconds(1), 0),  // received after the echo was written
      echoing(Duration::max(), written, 0),           // overflows every clock
  };
  std::uint64_t number = 0;
  for (const OutgoingEcho& echo : impossible) {
    a_.receive(now_, examples::data(number, echo, state(number + 1)));
    EXPECT_EQ(a_.stats().invalid, ++number);
    EXPECT_EQ(events(a_).size(), 1U);
    EXPECT_FALSE(a_.exchange());
  }
  EXPECT_EQ(a_.stats().round_trip, Duration{});
  a_.receive(now_ + milliseconds(1), examples::data(number, echoing(opened, written, 0)));
  EXPECT_EQ(a_.stats().invalid, number);
  EXPECT_EQ(a_.stats().round_trip, milliseconds(1) - std::chrono::microseconds(100));
}

TEST_F(TwoEnds, EachEndLearnsWhatWasLostInWhichDirection) {
  for (std::uint64_t n = 1; n <= 20; ++n) {
    a_.send(force(n));
    const auto there = pull(a_, now_);
    if (n % 4 != 0) deliver(z_, now_, there);  // 4, 8, 12, 16, 20 are lost
    z_.send(state(n));
    deliver(a_, now_, pull(z_, now_));
  }
  EXPECT_EQ(z_.stats().lost, 4U);  // 20 was the last and is not yet missing
  EXPECT_EQ(a_.stats().lost_outgoing, 4U);
  EXPECT_EQ(a_.stats().lost, 0U);
  EXPECT_EQ(z_.stats().lost_outgoing, 0U);
}

TEST_F(TwoEnds, WhoSpeaksNeedsNoKeepAlives) {
  for (int i = 0; i < 100; ++i) {
    now_ += milliseconds(10);
    a_.send(force(static_cast<std::uint64_t>(i) + 1));
    pull(a_, now_);
  }
  EXPECT_EQ(a_.stats().datagrams_sent, 100U);
}

TEST_F(TwoEnds, ASilentPeerIsGoneAfterTheTimeoutAndNotBefore) {
  now_ += milliseconds(700);
  deliver(z_, now_, pull(a_, now_));
  z_.tick(now_ + seconds(2) - Duration{1});
  EXPECT_TRUE(z_.open());
  z_.tick(now_ + seconds(2));
  EXPECT_FALSE(z_.open());
  const auto at_z = events(z_);
  ASSERT_EQ(at_z.size(), 1U);
  EXPECT_EQ(std::get<Session::Closed>(at_z[0]).code, Code::kTimedOut);
  EXPECT_EQ(std::get<Session::Closed>(at_z[0]).reason, "nothing received for 2000 ms");
  EXPECT_TRUE(pull(z_, now_ + seconds(3)).empty());
  EXPECT_EQ(z_.next_tick(), LocalTime::max());
}

TEST_F(TwoEnds, AByeIsSaidThreeTimesAndOneIsEnough) {
  a_.close(Code::kShutdown, "SIGTERM");
  EXPECT_FALSE(a_.open());
  EXPECT_LE(a_.next_tick(), now_);
  const auto byes = pull(a_, now_);
  ASSERT_EQ(byes.size(), 3U);
  EXPECT_EQ(a_.next_tick(), LocalTime::max());
  EXPECT_TRUE(events(a_).empty());

  z_.receive(now_, byes[2]);
  const auto closed = only<Session::Closed>(z_);
  EXPECT_EQ(closed.code, Code::kShutdown);
  EXPECT_EQ(closed.reason, "SIGTERM");
  z_.receive(now_, byes[1]);
  EXPECT_TRUE(events(z_).empty());
  EXPECT_TRUE(pull(z_, now_).empty());
}

TEST_F(TwoEnds, WhatArrivedBeforeTheByeIsToldBeforeTheEnd) {
  a_.send(force(1));
  deliver(z_, now_, pull(a_, now_));
  a_.close(Code::kOk, "");
  deliver(z_, now_, pull(a_, now_));
  const auto at_z = events(z_);
  ASSERT_EQ(at_z.size(), 2U);
  EXPECT_TRUE(std::holds_alternative<Session::ForceArrived>(at_z[0]));
  EXPECT_TRUE(std::holds_alternative<Session::Closed>(at_z[1]));
}

TEST_F(TwoEnds, AfterTheEndNothingIsBelieved) {
  a_.send(force(1));
  const auto datagrams = pull(a_, now_);
  z_.close(Code::kOk, "");
  deliver(z_, now_, datagrams);
  EXPECT_TRUE(events(z_).empty());
  EXPECT_EQ(z_.stats().datagrams_received, 0U);
}

TEST_F(TwoEnds, AReplayedDatagramIsCountedAndNothingElse) {
  a_.request(Rearm{});
  a_.send(force(1));
  const auto recorded = pull(a_, now_);
  deliver(z_, now_, recorded);
  events(z_);
  for (int i = 0; i < 5; ++i) deliver(z_, now_ + seconds(i) / 4, recorded);
  EXPECT_TRUE(events(z_).empty());
  EXPECT_EQ(z_.stats().duplicated, 5U);
  EXPECT_EQ(z_.stats().datagrams_received, 1U);
  z_.tick(now_ + seconds(2));
  EXPECT_FALSE(z_.open());  // the session must not be kept alive by this
}

TEST_F(TwoEnds, ADatagramOfAnotherConversationIsMalformed) {
  Session::Config other = config();
  other.connection_id += 1;
  Session stranger(other, kOpened);
  deliver(z_, now_, pull(stranger, now_));
  EXPECT_EQ(z_.stats().malformed, 1U);
  EXPECT_EQ(z_.stats().datagrams_received, 0U);
}

TEST_F(TwoEnds, AMalformedDatagramDoesNotUseUpThePacketNumberOfAGoodOne) {
  a_.send(force(1));
  const auto good = pull(a_, now_);
  Bytes bad = good[0];
  bad.pop_back();
  z_.receive(now_, bad);
  EXPECT_EQ(z_.stats().malformed, 1U);
  deliver(z_, now_, good);
  EXPECT_EQ(events(z_).size(), 1U);
}

TEST_F(TwoEnds, AWelcomeThatComesTwiceIsADuplicate) {
  z_.receive(now_, examples::datagrams()[2].bytes);
  EXPECT_EQ(z_.stats().duplicated, 1U);
  EXPECT_EQ(z_.stats().malformed, 0U);
}

TEST(Session, ImpossibleSettingsAreRefusedAtOnce) {
  for (Duration Session::Config::*field :
       {&Session::Config::keep_alive, &Session::Config::timeout, &Session::Config::min_resend}) {
    Session::Config bad = config();
    bad.*field = Duration{};
    EXPECT_THROW(Session(bad, kOpened), std::invalid_argument);
  }
}

}  // namespace
}  // namespace tendon::session_test
