// SPDX-License-Identifier: Apache-2.0
#include "server/assembly.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <string>
#include <vector>

#include "clients/cpp/force_client.h"
#include "devices/simulated/simulated_device.h"
#include "protocol/wire/header.h"
#include "tests/server/scene/scene_text.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/wire.h"

namespace tendon::assembly_test {
namespace {

using std::chrono::milliseconds;

constexpr LocalTime kStart(std::chrono::seconds(1000));
const std::string kFast = "[loop]\nperiod_us = 500\n";

Scene scene_of(const std::string& name, const std::string& more = "") {
  Scene scene = minimal_and(more);
  scene.name = name;
  return scene;
}

class Servers : public ::testing::Test {
 protected:
  void serve(const std::vector<Scene>& scenes, std::size_t networks = 1,
             std::optional<Mailboxes::Capacities> watched = {}) {
    std::vector<Assembly::Part> parts;
    for (const Scene& scene : scenes) {
      parts.push_back({.scene = scene, .device = devices_.emplace_back(scene.simulated())});
    }
    std::vector<Link*> links;
    for (std::size_t i = 0; i < networks; ++i) links.push_back(&ends_.emplace_back(wire_, server_));
    assembly_.emplace(std::move(parts), Assembly::Config{.now = kStart, .watched = watched}, links);
  }

  std::vector<std::size_t> group_sizes() {
    std::vector<std::size_t> sizes;
    for (const auto& group : assembly_->haptic_groups()) sizes.push_back(group.devices.size());
    return sizes;
  }

  const Address server_ = parse_address("127.0.0.1:47100");
  Wire wire_;
  std::deque<End> ends_;
  std::deque<SimulatedDevice> devices_;
  std::optional<Assembly> assembly_;
};

TEST_F(Servers, DevicesOfOnePeriodShareAHapticGroupThatStepsThemAtOneInstant) {
  serve({scene_of("a"), scene_of("b", kFast), scene_of("c")});
  EXPECT_EQ(group_sizes(), (std::vector<std::size_t>{2, 1}));
  EXPECT_EQ(assembly_->haptic_groups().front().turn(kStart), kStart + milliseconds(1));
  EXPECT_EQ(assembly_->devices()[0].haptic.stats().steps, 1U);
  EXPECT_EQ(assembly_->devices()[1].haptic.stats().steps, 0U);
  EXPECT_EQ(assembly_->devices()[2].haptic.stats().steps, 1U);
}

TEST_F(Servers, AHapticGroupAt1KHzHasAtMostThreeBanks) {
  std::vector<Scene> scenes;
  for (int i = 0; i < 50; ++i) scenes.push_back(scene_of("d-" + std::to_string(i)));
  serve(scenes, 2);
  EXPECT_EQ(group_sizes(), (std::vector<std::size_t>{48, 2}));
  EXPECT_EQ(assembly_->haptic_groups().front().networks, (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(assembly_->haptic_groups().back().networks, std::vector<std::size_t>{1});
  EXPECT_EQ(assembly_->first_device(1), 32U);
}

TEST_F(Servers, AHelloIsPassedOnToTheNetworkLoopThatServesItsDevice) {
  std::vector<Scene> scenes;
  for (int i = 0; i < 17; ++i) scenes.push_back(scene_of("d-" + std::to_string(i)));
  serve(scenes, 2, Mailboxes::Capacities{.steps = 2, .flight = 2, .datagrams = 1});
  End guest(wire_, parse_address("127.0.0.1:50000"));
  std::uint64_t states = 0;
  ForceClient client(
      guest, server_, {.name = "guest", .device = "d-16", .seed = 1},
      [&states](const DeviceState&, const LinkStats&) { ++states; }, kStart);
  for (LocalTime now = kStart; now < kStart + milliseconds(300); now += milliseconds(1)) {
    for (auto& group : assembly_->haptic_groups()) group.turn(now);
    for (std::size_t i = 0; i < assembly_->networks(); ++i) assembly_->turn_network(i, now);
    client.turn(now);
    for (; !wire_.empty(); wire_.pop_front()) {
      const auto header = decode_header(wire_.front().bytes);
      const bool of_session = header && header->type == DatagramType::kData;
      End& end = wire_.front().to == guest.self ? guest : ends_[of_session ? header->connection_id % 2 : 0];
      end.inbox.push_back(wire_.front());
    }
  }
  EXPECT_EQ(assembly_->network(0).stats().welcomed, 0U);
  EXPECT_EQ(assembly_->network(1).stats().welcomed, 1U);
  EXPECT_GT(states, 100U);
}

TEST_F(Servers, StepsAndDatagramsGoToTheRecordingUnlessTheCallerWatchesThem) {
  const testing::ScratchFolder folder;
  Scene scene = scene_of("left");
  scene.recording = Scene::Recording{.path = folder.path() / "run.mcap"};
  for (const bool watched : {false, true}) {
    serve({scene}, 1, watched ? std::optional(Mailboxes::Capacities{.steps = 16, .flight = 2}) : std::nullopt);
    ends_.back().inbox.push_back({parse_address("127.0.0.1:50000"), server_, Bytes(3)});
    assembly_->haptic_groups().front().turn(kStart);
    assembly_->turn_network(0, kStart);
    assembly_->log().close(kStart, 0);
    const auto recording = assembly_->log().recording();
    EXPECT_EQ(recording.has_value(), !watched);
    if (recording) EXPECT_EQ(recording->steps + recording->datagrams, 2U);
    const Mailboxes& mail = assembly_->devices().front().mail;
    EXPECT_EQ(mail.steps.front() != nullptr, watched);
    EXPECT_EQ(mail.datagrams.front() != nullptr, watched);
  }
}

}  // namespace
}  // namespace tendon::assembly_test
