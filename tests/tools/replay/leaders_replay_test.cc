// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "server/haptic_loop.h"
#include "server/recording/recording_codec.h"
#include "server/scene/scene.h"
#include "tests/tools/replay/rerun.h"
#include "tests/tools/replay/tapping.h"

namespace tendon::replay::leaders_replay_test {
namespace {

const std::string kCoupling =
    "stiffness_n_per_m = 400\n"
    "damping_n_s_per_m = 4\n"
    "[teleoperation.energy_tank]\n";

struct Running {
  Running(const std::string& text, std::uint64_t epoch)
      : scene(parse_scene(text, "scene", ".")), device(scene.simulated()) {
    scene.loop.control.coupling->spring.epoch = epoch;
    haptic.emplace(scene.loop, device, *mail);
  }
  Scene scene;
  SimulatedDevice device;
  std::unique_ptr<Mailboxes> mail =
      std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 4, .ports = 8, .flight = 2, .datagrams = 1});
  std::optional<HapticLoop> haptic;
};

struct Recorded {
  Scene scene;
  std::vector<std::vector<PortRecord>> ports;
  std::vector<StepRecord> steps;
};

Recorded recorded() {
  const std::string leading =
      std::string(testing::kTapping) + "[teleoperation]\nrole = \"leader\"\n[teleoperation.coupling]\n";
  Running follower(std::string(testing::kTapping) +
                       "[[channel]]\nname = \"desk\"\n[[channel]]\nname = \"one\"\n[[channel]]\nname = \"two\"\n"
                       "[teleoperation]\nrole = \"follower\"\n"
                       "[[teleoperation.leader]]\nchannel = \"one\"\nshare = 0.6\n"
                       "[[teleoperation.leader]]\nchannel = \"two\"\nshare = 0.4\n[teleoperation.coupling]\n" +
                       kCoupling,
                   1);
  std::deque<Running> leaders;
  leaders.emplace_back(leading + kCoupling, 2);
  leaders.emplace_back(leading + kCoupling, 3);
  Recorded all{.scene = follower.scene, .ports = {}, .steps = {}};
  LocalTime now(std::chrono::seconds(1));
  for (int ms = 0; ms < 3000; ++ms, now += std::chrono::milliseconds(1)) {
    if (ms == 100) leaders[0].mail->orders.try_push({HapticOrder::Kind::kEngage});
    if (ms == 700) leaders[1].mail->orders.try_push({HapticOrder::Kind::kEngage});
    if (ms == 1500) {
      follower.mail->orders.try_push({.kind = HapticOrder::Kind::kShare, .coupling = 1, .share = 1});
    }
    for (std::size_t i = 0; i < leaders.size(); ++i) {
      Mailboxes& mail = *leaders[i].mail;
      if (const PortState* told = follower.mail->port_out[i].take()) mail.port_in[0].put({*told, now});
      leaders[i].haptic->step(now);
      if (const PortState* told = mail.port_out[0].take()) follower.mail->port_in[i].put({*told, now});
      while (mail.steps.front() != nullptr) mail.steps.pop();
      while (mail.ports.front() != nullptr) mail.ports.pop();
    }
    follower.haptic->step(now);
    auto& ports = all.ports.emplace_back();
    for (const PortRecord* port = follower.mail->ports.front(); port != nullptr; port = follower.mail->ports.front()) {
      ports.push_back(recording::decode_port(recording::encode(*port), port->at));
      follower.mail->ports.pop();
    }
    all.steps.push_back(*follower.mail->steps.front());
    follower.mail->steps.pop();
  }
  return all;
}

/// Returns the first difference if each step uses only the couplings from `first` on.
std::string first_difference(const Recorded& all, std::size_t first) {
  Rerun rerun(all.scene.loop.control, Rerun::Held::kRecorded);
  for (std::size_t i = 0; i < all.steps.size(); ++i) {
    for (std::size_t which = first; which < all.ports[i].size(); ++which) rerun.settled(all.ports[i][which]);
    const std::string how = difference(all.steps[i], rerun.step(all.steps[i]));
    if (!how.empty()) return "step " + std::to_string(all.steps[i].tick) + ": " + how;
  }
  return "";
}

TEST(LeadersReplay, AFollowerOfTwoDecidesTheSameAgainToTheLastBit) {
  const Recorded all = recorded();
  ASSERT_EQ(all.ports.back().size(), 2U);
  EXPECT_EQ(all.ports.back()[0].channel, 1U);
  EXPECT_EQ(all.ports.back()[1].channel, 2U);
  EXPECT_EQ(all.ports.back()[1].sent.share, 1);
  double paid[2] = {};
  for (const auto& of_step : all.ports) {
    for (std::size_t which = 0; which < 2; ++which) {
      paid[which] += of_step[which].settled.credit + of_step[which].settled.withdraw;
    }
  }
  EXPECT_GT(paid[0], 0);
  EXPECT_GT(paid[1], 0);
  EXPECT_EQ(first_difference(all, 0), "");
  EXPECT_NE(first_difference(all, 1), "") << "one of them is not enough";
}

}  // namespace
}  // namespace tendon::replay::leaders_replay_test
