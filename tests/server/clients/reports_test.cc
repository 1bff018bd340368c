// SPDX-License-Identifier: Apache-2.0
#include "tests/server/clients/sealed_server.h"

#include <algorithm>
#include <deque>
#include <string>
#include <utility>

#include "core/base/arithmetic.h"
#include "core/remote/answer.h"

namespace tendon::reports_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST_F(SealedServer, TellsControllersAloneOnceASecondHowTheirForcesFare) {
  Client a = controller(wall_, "192.0.2.1:4000");
  Client b = observer(screen_, "192.0.2.2:4000");
  run(milliseconds(3500), {&a, &b});
  ASSERT_TRUE(a->report().has_value());
  const LinkReport& report = *a->report();
  EXPECT_EQ(report.number, 3U);
  EXPECT_EQ(report.span, seconds(1));
  EXPECT_GT(report.forces, 900U);
  EXPECT_EQ(report.late_server + report.late_network + report.late_engine, 0U);
  EXPECT_EQ(report.words, "");
  EXPECT_EQ(report.lost, 0U);
  EXPECT_GT(report.received, 2900U);
  ASSERT_TRUE(report.round_trip && report.to_server && report.to_client);
  EXPECT_LE(report.round_trip->p99, milliseconds(2));
  // Both ends share one clock.
  EXPECT_LE(std::chrono::abs(report.clock_offset), report.clock_error);
  EXPECT_LE(std::chrono::abs(report.to_server->median + report.to_client->median - report.round_trip->median),
            milliseconds(1));
  EXPECT_FALSE(b->report().has_value());
}

/// The delay is 20 ms in each direction. One of the ends is preempted for 36 ms while it is in a turn. A datagram that
/// arrives meanwhile is handled with the time at the beginning of the turn.
class InterruptedTurn : public SealedServer, public testing::WithParamInterface<bool> {};

TEST_P(InterruptedTurn, MakesNoWayLookShort) {
  const bool of_server = GetParam();
  Client a = controller(wall_, "192.0.2.1:4000");
  std::deque<std::pair<LocalTime, Datagram>> under_way;
  const LocalTime begins = now_ + milliseconds(2000);
  const LocalTime goes_on = begins + milliseconds(36);
  for (const LocalTime end = now_ + milliseconds(5500); now_ < end; now_ += milliseconds(1)) {
    put_states();
    for (; !under_way.empty() && under_way.front().first <= now_; under_way.pop_front()) {
      const Datagram& datagram = under_way.front().second;
      (datagram.to == server_ ? ends_[0] : *a.end).inbox.push_back(datagram);
    }
    const bool interrupted = now_ >= begins && now_ < goes_on;
    const LocalTime told = now_ == goes_on ? begins : now_;
    End& end_of_it = of_server ? ends_[0] : *a.end;
    end_of_it.taken = now_;
    if (!(interrupted && of_server)) loop().turn(of_server ? told : now_);
    if (!(interrupted && !of_server)) a->turn(of_server ? now_ : told);
    for (; count_ < wire_.size(); ++count_) under_way.emplace_back(now_ + milliseconds(20), wire_[count_]);
  }
  ASSERT_TRUE(a->report() && a->report()->to_server && a->report()->to_client);
  for (const auto& way : {a->report()->to_server, a->report()->to_client}) {
    EXPECT_GE(way->median, milliseconds(18));
    EXPECT_LE(way->median, milliseconds(22));
  }
}

INSTANTIATE_TEST_SUITE_P(OfTheServerAndOfTheClient, InterruptedTurn, testing::Bool());

TEST_F(SealedServer, AStampShortensTheRoundTripAndMakesNoForceEarlier) {
  // The server reads each datagram 1 ms after it was sent.
  const auto measured = [&](Duration waited) {
    restart();
    Client a = controller(wall_, "192.0.2.1:4000");
    ends_[0].waited = waited;
    run(milliseconds(2500), {&a});
    const RemoteForce* const force = mail(0).forces[0].take();
    EXPECT_TRUE(force != nullptr && force->received == now_ - milliseconds(1)) << "when it was read";
    EXPECT_EQ(stats().late_ours + stats().late_network + stats().late_engine + stats().late_unknown, 0U);
    return a->report()->round_trip->median;
  };
  const Duration without = measured({});
  constexpr Duration kWaited = std::chrono::microseconds(700);
  EXPECT_EQ(measured(kWaited), without - kWaited);
}

TEST_F(SealedServer, SaysByNumbersAndInWordsThatTheNetworkWasLate) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(1500), {&a});
  run(milliseconds(60), {&a}, [](Datagram&) { return false; });
  run(milliseconds(600), {&a});
  ASSERT_TRUE(a->report().has_value());
  const LinkReport& report = *a->report();
  EXPECT_EQ(report.number, 2U);
  EXPECT_GT(report.longest_gap, milliseconds(55));
  EXPECT_GE(report.lost, 1U);
  EXPECT_EQ(report.late_network, 1U);
  EXPECT_EQ(report.late_engine + report.late_server, 0U);
  EXPECT_NEAR(tendon::seconds(report.worst_late), 40e-3, 4e-3);  // valid for 20 ms
  EXPECT_NE(report.words.find("the network (datagrams were lost)"), std::string::npos) << report.words;
  EXPECT_EQ(stats().late_network, 1U);
  EXPECT_GT(std::ranges::count(take_notices(), report.words), 0);
}

TEST_F(SealedServer, APauseOfItsOwnIsBlamedOnNobodyElse) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(1500), {&a});
  for (int ms = 0; ms < 200; ++ms) {  // SIGSTOP: datagrams for the engine wait in its socket
    now_ += milliseconds(1);
    a->turn(now_);
  }
  run(milliseconds(600), {&a});
  ASSERT_TRUE(a->report().has_value());
  const LinkReport& report = *a->report();
  EXPECT_EQ(report.late_server, 1U);
  EXPECT_EQ(report.late_network + report.late_engine + report.late_unknown, 0U) << report.words;
  EXPECT_NE(report.words.find("the server (its threads were stopped for 20"), std::string::npos) << report.words;
}

struct BadForces {
  const char* name;
  void (*spoil)(ForceCommand&);
  std::uint64_t RefusedForces::*count;
  const char* words;
};
class BadForcesTest : public SealedServer, public testing::WithParamInterface<BadForces> {};

TEST_P(BadForcesTest, TheirAuthorIsToldWhatIsWrongWithThem) {
  restart_without_keys();
  const auto report = run_foreign(milliseconds(2500), GetParam().spoil);
  ASSERT_TRUE(report.has_value());
  EXPECT_NE(report->words.find(GetParam().words), std::string::npos) << report->words;
  EXPECT_GT(report->refused.*GetParam().count, 900U);
  EXPECT_EQ(report->late_network + report->late_server + report->late_unknown, 0U);
  EXPECT_GT(std::ranges::count(take_notices(), report->words), 0);
}

TEST_P(BadForcesTest, ThatFollowGoodOnesAreNamedAsTheCauseOfLateness) {
  restart_without_keys();
  const LocalTime turns_bad = now_ + milliseconds(1500);
  const auto report = run_foreign(milliseconds(2500), [&](ForceCommand& force) {
    if (now_ > turns_bad) GetParam().spoil(force);
  });
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->words.find("forces were late once, by up to "), 0U) << report->words;
  EXPECT_NE(report->words.find(GetParam().words), std::string::npos) << report->words;
  EXPECT_EQ(report->late_engine, 1U);
}

INSTANTIATE_TEST_SUITE_P(
    Of, BadForcesTest,
    ::testing::Values(BadForces{"NotFinite", [](ForceCommand& f) { f.force.y() = NAN; }, &RefusedForces::not_finite,
                                "the engine (its forces are not finite)"},
                      BadForces{"NotFiniteModel",
                                [](ForceCommand& f) { f.model = LocalModel{.stiffness = Mat3::Constant(-INFINITY)}; },
                                &RefusedForces::not_finite, "the engine (its forces are not finite)"},
                      BadForces{"OutOfBounds", [](ForceCommand& f) { f.force.x() = 2e12; },
                                &RefusedForces::out_of_bounds, "the engine (its forces exceed the bounds in WIRE.md)"},
                      BadForces{"NeverValid", [](ForceCommand& f) { f.valid_for = {}; }, &RefusedForces::out_of_bounds,
                                "the engine (its forces exceed the bounds in WIRE.md)"},
                      BadForces{"UnknownTick", [](ForceCommand& f) { f.based_on_tick += 100'000; },
                                &RefusedForces::unknown_tick, "the engine (its forces answer unknown or old ticks)"},
                      BadForces{"OldSequence", [](ForceCommand& f) { f.sequence = 1; }, &RefusedForces::old_sequence,
                                "the engine (its sequence numbers do not increase)"}),
    [](const auto& test) { return std::string(test.param.name); });

// The haptic loop flushes denormal numbers to zero.
TEST_F(SealedServer, ATableWithADenormalStepReachesTheDeviceAsASoundOne) {
  restart_without_keys();
  run_foreign(milliseconds(300), [](ForceCommand& force) {
    Contact contact{.normal = Vec3(-1, 0, 0)};
    contact.table = ForceTable{.step = 5e-324, .size = 2, .force = {1, 2}};
    force.model = LocalModel{.contact = contact};
  });
  const RemoteForce* const force = mail().forces[0].take();
  ASSERT_NE(force, nullptr);
  ASSERT_TRUE(force->model && force->model->contact && force->model->contact->table);
  const DenormalsOff off;
  EXPECT_TRUE(is_sound(*force));
}

TEST_F(SealedServer, AControllerThatHasSentNoForceIsToldNothingAboutItsForces) {
  Client a = controller(wall_, "192.0.2.1:4000", {}, [](const DeviceState&) { return Touch(Vec3::Constant(NAN)); });
  run(seconds(3), {&a});
  EXPECT_EQ(phase(a), Phase::kOpen);
  EXPECT_FALSE(a->report().has_value());
}

}  // namespace
}  // namespace tendon::reports_test
