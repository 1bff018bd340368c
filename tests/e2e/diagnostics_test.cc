// SPDX-License-Identifier: Apache-2.0
// Tests the reports on the server, the network and the device that an observer receives. Times have no upper bounds.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "clients/cpp/udp_transport.h"
#include "server/machine/clock.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::diagnostics_test {
namespace {

using testing::ScratchFolder;

class Guest {
 public:
  Guest(const std::string& server, Watch watch) : address_(parse_address(server)), link_(address_) {
    ForceClient::Config config = named("watcher");
    config.diagnostics = true;
    client_.emplace(link_, address_, config, std::move(watch), clock::now());
  }
  Guest(const std::string& server, Physics physics) : address_(parse_address(server)), link_(address_) {
    client_.emplace(link_, address_, named("engine"), std::move(physics), clock::now());
  }

  ForceClient& client() { return *client_; }
  void turn() {
    const LocalTime due = client_->turn(clock::now());
    link_.wait(std::clamp<Duration>(due - clock::now(), Duration::zero(), std::chrono::milliseconds(5)));
  }

 private:
  static ForceClient::Config named(const std::string& name) {
    ForceClient::Config config;
    config.name = name;
    config.seed = std::hash<std::string>()(name);  // not security relevant in a test
    return config;
  }
  Address address_;
  UdpTransport link_;
  std::optional<ForceClient> client_;
};

bool turn_until(std::vector<Guest*> guests, const std::function<bool()>& done) {
  const LocalTime end = clock::now() + kPatience;
  while (!done()) {
    if (clock::now() > end) return false;
    for (Guest* guest : guests) guest->turn();
  }
  return true;
}

TEST(Diagnostics, AnObserverSeesWantedForcesTheLoopAndTheNetwork) {
  const ScratchFolder folder;
  Server server(folder.path(), write(folder.path() / "scene.toml", kPressingHand));
  Service network("tendon-inject",
                  {"--to", server.address(), "--up", "delay=20ms loss=10%", "--down", "delay=20ms",
                   "--max-release-error-us", "60000000"},
                  folder.path(), "start", "listen");
  Client wall("virtual_wall", network.address(), folder.path());

  double most_wanted = 0;
  Guest watcher(server.address(), [&](const DeviceState& hand, const LinkStats&) {
    if (hand.force_wanted) most_wanted = std::max(most_wanted, -hand.force_wanted->x());
  });
  const auto wall_is_lossy = [&] {
    const auto& peers = watcher.client().peer_reports();
    return peers.size() == 1 && peers[0].link.lost > 0 && peers[0].link.round_trip && peers[0].link.forces > 0;
  };
  ASSERT_TRUE(turn_until({&watcher}, [&] {
    return most_wanted > 0.5 && wall_is_lossy() && watcher.client().device_report().has_value();
  })) << most_wanted;

  const DeviceReport& loop = *watcher.client().device_report();
  EXPECT_EQ(std::accumulate(loop.lateness.begin(), loop.lateness.end(), std::uint64_t{0}), loop.steps);
  EXPECT_GT(loop.steps, 0U);
  EXPECT_GT(loop.span, Duration::zero());
  EXPECT_EQ(loop.safety, Safety::kUnguarded);
  EXPECT_EQ(loop.fault, "");
  EXPECT_EQ(loop.degraded.find("recording"), std::string::npos) << loop.degraded;

  const PeerReport& peer = watcher.client().peer_reports()[0];
  EXPECT_EQ(peer.name, "virtual_wall");
  EXPECT_GE(peer.link.round_trip->median, std::chrono::milliseconds(40));
  EXPECT_FALSE(peer.forces_refused);
  EXPECT_EQ(watcher.client().stats().link.invalid, 0U);
  server.stop();
}

// The faults of a force are covered in virtual time by tests/server (BadForces, SealedServer).
TEST(Diagnostics, AnEngineThatSleepsOnThisMachineIsBlamedAndNeverTheNetwork) {
  const ScratchFolder folder;
  Server server(folder.path(), write(folder.path() / "scene.toml", kPressingHand));
  Guest watcher(server.address(), [](const DeviceState&, const LinkStats&) {});
  Guest engine(server.address(), [](const DeviceState& hand) { return Touch(Vec3(-1000 * hand.position.x(), 0, 0)); });

  // This exceeds short pauses of a machine, which look like a slow network.
  constexpr Duration kAsleep = std::chrono::milliseconds(500);
  std::uint64_t last = 0;
  int told = 0;
  const auto read = [&] {
    const auto& peers = watcher.client().peer_reports();
    if (peers.empty() || peers[0].link.number == last) return;
    const LinkReport& report = peers[0].link;
    last = report.number;
    if (report.worst_late < kAsleep) return;
    ++told;
    EXPECT_GT(report.late_engine, 0U) << report.words;
    EXPECT_NE(report.words.find("the engine"), std::string::npos) << report.words;
    EXPECT_EQ(report.words.find("the network"), std::string::npos) << report.words;
  };
  ASSERT_TRUE(turn_until({&engine, &watcher}, [&] { return engine.client().stats().forces > 200; }));

  const LocalTime wakes = clock::now() + std::chrono::milliseconds(2500);  // the server ends the session in this time
  ASSERT_TRUE(turn_until({&watcher}, [&] {
    read();
    return clock::now() > wakes;
  }));
  const std::uint64_t before = engine.client().stats().forces;
  ASSERT_TRUE(turn_until({&engine, &watcher}, [&] {
    read();
    return engine.client().stats().forces > before + 700;
  }));
  EXPECT_GT(told, 0);
  server.stop();
}

TEST(Diagnostics, AnObserverSeesArmingAndFaultAndStepsBeforeItAreKept) {
  const ScratchFolder folder;
  // The hand rests until the device is armed and has reported this. Then it moves too fast.
  const std::string scene = R"([device]
kind = "simulated"
profile = "falcon"
[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05
[device.hand.motion]
kind = "minimum-jerk"
points_mm = [[-10, 0, 0], [-10, 0, 0], [15, 0, 0]]
durations_ms = [2500, 300]
back_and_forth = true
[safety.speed_trip]
max_m_per_s = 0.05
)";
  Server server(folder.path(), write(folder.path() / "scene.toml", scene), {"--record", "/dev/null"});
  Guest watcher(server.address(), [](const DeviceState&, const LinkStats&) {});
  Guest engine(server.address(), [](const DeviceState&) { return Touch(Vec3::Zero()); });
  const auto reported = [&](Safety safety) {
    const auto& report = watcher.client().device_report();
    return report && report->safety == safety;
  };
  ASSERT_TRUE(turn_until({&watcher, &engine}, [&] { return reported(Safety::kHomed); }));
  std::uint64_t turns = 0;
  ASSERT_TRUE(turn_until({&watcher, &engine}, [&] {
    if (++turns % 100 == 0) engine.client().rearm();
    return reported(Safety::kArmed);
  }));
  EXPECT_EQ(watcher.client().device_report()->fault, "");
  ASSERT_TRUE(turn_until({&watcher, &engine}, [&] { return reported(Safety::kFault); }));
  EXPECT_EQ(watcher.client().device_report()->fault, "the handle was faster than speed_trip allows");
  const std::string told = server.process().wait_for_line("the steps before the fault are ");
  EXPECT_NE(told.find(" are saved in tendon.fault-1.mcap"), std::string::npos) << told;
  EXPECT_FALSE(read_recording(folder.path() / "tendon.fault-1.mcap").steps.empty());
  server.stop();
}

}  // namespace
}  // namespace tendon::e2e::diagnostics_test
