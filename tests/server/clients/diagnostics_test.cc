// SPDX-License-Identifier: Apache-2.0
#include "tests/server/clients/sealed_server.h"

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

namespace tendon::diagnostics_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

std::uint64_t sum(const LatenessHistogram& lateness) {
  return std::accumulate(lateness.begin(), lateness.end(), std::uint64_t{0});
}

/// The observer requests all features. `a` and `b` only send if they are passed to `run`.
class Diagnosed : public SealedServer {
 protected:
  Client a = controller(wall_, "192.0.2.1:4000");
  DeviceState seen;
  Client b = observer(screen_, "192.0.2.2:4000", {.diagnostics = true}, into(seen));
};

TEST_F(Diagnosed, TellsAnObserverThatAsksHowTheLoopAndTheEngineDo) {
  wanted_ = Vec3(3, 0, -4);
  measured_ = true;
  health_.steps = health_.lateness[2] = 1'000'000;  // accumulated long before
  health_.safety = Safety::kArmed;
  run(milliseconds(1500), {&a, &b});
  ASSERT_TRUE(b->device_report().has_value());
  EXPECT_EQ(b->device_report()->number, 1U);
  health_.safety = Safety::kFault;
  health_.fault = "the handle was faster than a hand";
  health_.missed = 7;
  health_.overruns = 2;
  health_.unseen = 3;
  health_.recording_ended = true;
  run(milliseconds(1000), {&a, &b});

  ASSERT_TRUE(seen.force_wanted.has_value());
  EXPECT_EQ(*seen.force_wanted, Vec3(3, 0, -4));
  ASSERT_TRUE(seen.stiffness_wanted.has_value());
  EXPECT_EQ(*seen.stiffness_wanted, Mat3::Identity());
  const DeviceReport& report = *b->device_report();
  EXPECT_EQ(report.number, 2U);
  EXPECT_EQ(report.span, seconds(1));
  EXPECT_EQ(report.steps, 1000U);
  EXPECT_EQ(sum(report.lateness), report.steps);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(report.lateness[i], 100U) << i;
  EXPECT_EQ(report.missed, 7U);
  EXPECT_EQ(report.overruns, 2U);
  EXPECT_EQ(report.unseen, 3U);
  EXPECT_EQ(report.safety, Safety::kFault);
  EXPECT_EQ(report.fault, "the handle was faster than a hand");
  EXPECT_EQ(report.degraded, "recording has stopped");

  ASSERT_EQ(b->peer_reports().size(), 1U);
  const PeerReport& peer = b->peer_reports().front();
  EXPECT_EQ(peer.name, "wall");
  EXPECT_EQ(peer.state_one_in, 1U);
  EXPECT_FALSE(peer.forces_refused);
  ASSERT_TRUE(a->report().has_value());
  const LinkReport& own = *a->report();
  EXPECT_EQ(peer.link.until, own.until);
  EXPECT_EQ(peer.link.forces, own.forces);
  EXPECT_EQ(peer.link.received, own.received);
  ASSERT_TRUE(peer.link.round_trip.has_value());
  EXPECT_EQ(peer.link.round_trip->median, own.round_trip->median);
  EXPECT_EQ(peer.link.words, own.words);
}

TEST_F(Diagnosed, AnObserverSeesWhatAnEnginesLinkHasLostAndForHowLong) {
  run(milliseconds(1500), {&a, &b});
  run(milliseconds(60), {&a, &b}, [&](Datagram& d) { return d.from != a.end->self && d.to != a.end->self; });
  run(milliseconds(600), {&a, &b});
  ASSERT_EQ(b->peer_reports().size(), 1U);
  const LinkReport& link = b->peer_reports().front().link;
  EXPECT_GE(link.lost, 1U);
  EXPECT_GT(link.longest_gap, milliseconds(55));
  EXPECT_EQ(link.late_network, 1U);
  EXPECT_NE(link.words.find("the network (datagrams were lost)"), std::string::npos) << link.words;
  EXPECT_EQ(b->stats().link.invalid, 0U);
}

TEST_F(SealedServer, AnObserverIsToldOfAnEngineThatSendsNoForceToo) {
  Client a = controller(wall_, "192.0.2.1:4000", {}, [](const DeviceState&) { return Touch(Vec3::Constant(NAN)); });
  Client b = observer(screen_, "192.0.2.2:4000", {.diagnostics = true});
  run(milliseconds(2500), {&a, &b});
  ASSERT_EQ(b->peer_reports().size(), 1U);
  const LinkReport& link = b->peer_reports().front().link;
  EXPECT_EQ(link.number, 2U);
  EXPECT_EQ(link.forces, 0U);
  EXPECT_GT(link.received, 0U);
  EXPECT_TRUE(link.round_trip.has_value());
}

TEST_F(Diagnosed, WhatAnObserverWasToldGoesWithItsSession) {
  measured_ = true;
  run(milliseconds(2500), {&a, &b});
  EXPECT_TRUE(b->device_report().has_value());
  EXPECT_FALSE(b->peer_reports().empty());
  loop().close(now_);
  measured_ = false;
  run(milliseconds(500), {&b});
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(b->stats().sessions, 2U);
  EXPECT_FALSE(b->device_report().has_value());
  EXPECT_TRUE(b->peer_reports().empty());
}

TEST_F(SealedServer, WhoDoesNotAskIsToldNothingOfIt) {
  Client a = controller(wall_, "192.0.2.1:4000");
  DeviceState seen;
  Client b = observer(screen_, "192.0.2.2:4000", {}, into(seen));
  Client c = observer(screen_, "192.0.2.3:4000", {.diagnostics = true});
  wanted_ = Vec3(3, 0, -4);
  measured_ = true;
  run(milliseconds(2500), {&a, &b, &c});
  EXPECT_GT(seen.tick, 2000U);
  EXPECT_FALSE(seen.force_wanted.has_value());
  EXPECT_FALSE(seen.stiffness_wanted.has_value());
  EXPECT_FALSE(b->device_report().has_value());
  EXPECT_TRUE(b->peer_reports().empty());
  EXPECT_TRUE(c->device_report().has_value());
  EXPECT_TRUE(c->peer_reports().size() == 1);
  EXPECT_FALSE(a->device_report().has_value());
}

TEST_F(SealedServer, AnEngineReceivesNotOneByteMoreWhereOthersDiagnose) {
  const auto to_engine = [&](bool others_diagnose) {
    wire_.clear();
    count_ = 0;
    now_ = LocalTime(seconds(1000));
    tick_ = 0;
    seed_ = 10;
    health_ = {};
    restart_without_keys();
    wanted_ = others_diagnose ? std::optional(Vec3(3, 0, -4)) : std::nullopt;
    measured_ = others_diagnose;
    Client a = controller({}, "127.0.0.1:4000");
    run(milliseconds(100), {&a});
    Client b = observer({}, "127.0.0.1:5000", {.diagnostics = others_diagnose});
    run(milliseconds(2500), {&a, &b});
    EXPECT_EQ(phase(a), Phase::kOpen);
    EXPECT_EQ(b->device_report().has_value(), others_diagnose);
    std::vector<Bytes> datagrams;
    for (const Datagram& datagram : wire_) {
      if (datagram.to == a.end->self) datagrams.push_back(datagram.bytes);
    }
    return datagrams;
  };
  const auto before = to_engine(false);
  EXPECT_GT(before.size(), 2500U);
  EXPECT_TRUE(to_engine(true) == before);
}

/// Our own client never requests this feature as a controller.
TEST_F(SealedServer, AControllerIsNotGrantedTheFeatureAndIsToldNothingOfIt) {
  restart_without_keys();
  wanted_ = Vec3(3, 0, -4);
  measured_ = true;
  std::uint64_t states = 0;
  const std::vector<std::string> granted = run_seeing(
      {std::string(kFeatureLocalModel), std::string(kFeatureDiagnostics)}, milliseconds(2500),
      [&](const Session::Event& event) {
        const auto* arrived = std::get_if<Session::StateArrived>(&event);
        ASSERT_NE(arrived, nullptr);
        EXPECT_FALSE(arrived->state.force_wanted.has_value());
        EXPECT_FALSE(arrived->state.stiffness_wanted.has_value());
        ++states;
      },
      Role::kController);
  EXPECT_EQ(granted, std::vector{std::string(kFeatureLocalModel)});
  EXPECT_GT(states, 2000U);
}

TEST_F(TwoDevices, AnObserverIsToldOfItsDeviceAndOfEachEngineThere) {
  Client left = controller(wall_, "192.0.2.1:4000", {.device = "left", .channel = "main"});
  Client right = controller(other_, "192.0.2.2:4000", {.device = "right", .channel = "tissue", .take_lease = true});
  Client waits = controller(wall_, "192.0.2.5:4000",
                            {.device = "right", .channel = "tissue"});  // has no lease, so it is not in a report
  Client watches_left = observer(screen_, "192.0.2.3:4000", {.device = "left", .diagnostics = true});
  Client watches_right = observer(screen_, "192.0.2.4:4000", {.device = "right", .diagnostics = true});
  measured_ = true;
  run(milliseconds(500), {&left, &right});
  run(milliseconds(2500), {&left, &right, &waits, &watches_left, &watches_right});
  EXPECT_TRUE(right->holds());
  EXPECT_EQ(phase(waits), Phase::kOpen);
  EXPECT_FALSE(waits->holds());
  ASSERT_TRUE(watches_left->device_report() && watches_right->device_report());
  EXPECT_EQ(watches_left->device_report()->device, 0U);
  EXPECT_EQ(watches_right->device_report()->device, 1U);
  ASSERT_EQ(watches_left->peer_reports().size(), 1U);
  ASSERT_EQ(watches_right->peer_reports().size(), 1U);
  EXPECT_EQ(watches_left->peer_reports()[0].name, "wall");
  const PeerReport& tissue = watches_right->peer_reports()[0];
  EXPECT_EQ(tissue.name, "other");
  EXPECT_EQ(tissue.device, 1U);
  EXPECT_EQ(tissue.channel, 1U);
  EXPECT_EQ(watches_left->stats().link.invalid + watches_right->stats().link.invalid, 0U);
}

TEST_F(Diagnosed, AForceThatIsNoNumberIsNotToldAndCostsNoState) {
  wanted_ = Vec3(NAN, 0, 0);
  run(milliseconds(500), {&b});
  EXPECT_GT(seen.tick, 400U);
  EXPECT_FALSE(seen.force_wanted.has_value());
  EXPECT_FALSE(seen.stiffness_wanted.has_value());
  wanted_ = Vec3(0, 2e12, 0);
  run(milliseconds(100), {&b});
  EXPECT_GT(seen.tick, 500U);
  EXPECT_FALSE(seen.force_wanted.has_value());
  EXPECT_FALSE(seen.stiffness_wanted.has_value());
  EXPECT_EQ(b->stats().link.invalid, 0U);
}

TEST_F(Diagnosed, WhereTheLogThreadSaysNothingThereIsNoReportOnADevice) {
  measured_ = true;
  run(milliseconds(1500), {&b});
  ASSERT_TRUE(b->device_report().has_value());
  measured_ = false;
  run(seconds(3), {&b});
  EXPECT_EQ(b->device_report()->number, 2U);  // the last report before it stopped
  health_.steps_lost += 100;                  // lost because the ring was full
  measured_ = true;
  run(seconds(1), {&b});
  const DeviceReport& report = *b->device_report();
  EXPECT_EQ(report.number, 3U);
  EXPECT_GT(report.span, seconds(3));
  EXPECT_EQ(report.steps, sum(report.lateness));
  EXPECT_EQ(report.degraded, "the log thread is too slow");
}

TEST_F(SealedServer, SaysThatAnEnginesWayIsFullAndThatItsForcesAreNotTaken) {
  scenes_[0].network.adapt_state_rate = true;
  restart();
  Client a = controller(wall_, "192.0.2.1:4000");
  Client b = observer(screen_, "192.0.2.2:4000", {.diagnostics = true});
  std::uint64_t n = 0;
  run(milliseconds(500), {&a, &b});
  run(seconds(15), {&a, &b}, [&](Datagram& d) { return d.to != a.end->self || ++n % 2 == 0; });
  ASSERT_EQ(b->peer_reports().size(), 1U);
  EXPECT_EQ(b->peer_reports().front().state_one_in, 20U);
  EXPECT_TRUE(b->peer_reports().front().forces_refused);
}

class EngineWithWays : public SealedServer {
 protected:
  Client engine(const std::vector<std::string>& ways) {
    return controller(wall_, "192.0.2.1:4000", {.ways = ways}, [this](const DeviceState&) { return touch(); });
  }
  Touch touch() {
    ++answers_;
    Touch touch = Vec3(1, 0, 0);
    touch.error = 0.01;
    touch.way = 1;
    if (unsure_ && answers_ % 100 == 50) {
      touch.error = 0.5;
      touch.way = 2;
    }
    return touch;
  }

  Client b = observer(screen_, "192.0.2.2:4000", {.diagnostics = true});
  int answers_ = 0;
  bool unsure_ = true;
};

TEST_F(EngineWithWays, AnObserverIsToldHowSureTheLeastSureForceWasAndItsWay) {
  Client a = engine({"tabulated", "near"});
  run(milliseconds(1500), {&a, &b});
  ASSERT_EQ(b->peer_reports().size(), 1U);
  EXPECT_EQ(b->peer_reports()[0].error, 0.5);
  EXPECT_EQ(b->peer_reports()[0].way, "near");
  unsure_ = false;
  run(seconds(2), {&a, &b});
  EXPECT_EQ(b->peer_reports()[0].error, 0.01) << "of that second";
  EXPECT_EQ(b->peer_reports()[0].way, "tabulated");
  EXPECT_EQ(b->stats().link.invalid, 0U);
}

TEST_F(EngineWithWays, TheStepAndTheCountsOfTheServerSayTheWay) {
  Client a = engine({"near", "linear"});
  run(seconds(1), {&a});
  const RemoteForce* const force = mail().forces[0].take();
  ASSERT_NE(force, nullptr);
  EXPECT_EQ(mail().ways.name_of(force->way), "near");
  const auto channel = stats().channels[0];
  EXPECT_EQ(channel.worst_error, 0.5);
  ASSERT_EQ(channel.ways.size(), 2U);
  EXPECT_EQ(channel.ways[0].first, "near");
  EXPECT_EQ(channel.ways[1].first, "linear");
  EXPECT_EQ(channel.ways[0].second + channel.ways[1].second, channel.forces);
  EXPECT_NEAR(static_cast<double>(channel.ways[1].second), static_cast<double>(channel.forces) / 100, 1);
}

TEST_F(EngineWithWays, TheNextEngineIsNotBlamedForTheDoubtsOfTheOneBefore) {
  Client a = engine({"tabulated", "near"});
  run(milliseconds(1990), {&a, &b});  // the next report is at 2 s
  a->stop(now_);
  Client c = controller(other_, "192.0.2.3:4000");
  run(milliseconds(400), {&a, &b, &c});
  ASSERT_EQ(b->peer_reports().size(), 1U);
  EXPECT_EQ(b->peer_reports()[0].name, "other");
  EXPECT_FALSE(b->peer_reports()[0].error.has_value());
  EXPECT_EQ(b->peer_reports()[0].way, "");
}

TEST_F(EngineWithWays, AnEngineThatSaysNoErrorIsShownByItsNewestWay) {
  ServedChannel::Doubt doubt;
  doubt.observe({}, 1);
  doubt.observe({}, 2);
  EXPECT_FALSE(doubt.error.has_value());
  EXPECT_EQ(doubt.way, 2);
  doubt.observe(0.0, 3);
  EXPECT_EQ(doubt.error, 0.0);
  doubt.observe({}, 4);
  doubt.observe(0.0, 5);
  EXPECT_EQ(doubt.way, 5) << "of those as unsure the newest";
  doubt.observe(-0.0, 6);
  doubt.observe(0.5, 7);
  doubt.observe(0.25, 8);
  EXPECT_EQ(doubt.error, 0.5);
  EXPECT_EQ(doubt.way, 7);
}

TEST_F(EngineWithWays, AWayThatWasNotNamedCountsForNothingAndTheForceIsTaken) {
  const struct {
    std::vector<std::string> features;
    std::vector<std::string> ways;
    std::uint32_t said;
    std::uint8_t counted;
    const char* what;
  } cases[] = {{{}, {}, 1, 0, "it has not named the feature"},
               {{}, {"near"}, 1, 0, "names without the feature"},
               {{std::string(kFeatureWays)}, {"near"}, 2, 0, "the second of one"},
               {{std::string(kFeatureWays)}, {""}, 1, 0, "an empty name"},
               {{std::string(kFeatureWays)}, {"near"}, 1, 1, "a way that was named"}};
  for (const auto& [features, ways, said, counted, what] : cases) {
    restart_without_keys();
    foreign_.features = features;
    foreign_.ways = ways;
    run_foreign(milliseconds(300), [way = said](ForceCommand& force) { force.way = way; });
    const RemoteForce* const force = mail().forces[0].take();
    ASSERT_NE(force, nullptr) << what;
    EXPECT_EQ(force->way, counted) << what;
    EXPECT_EQ(stats().channels[0].ways.empty(), counted == 0) << what;
  }
}

}  // namespace
}  // namespace tendon::diagnostics_test
