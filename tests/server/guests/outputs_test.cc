// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>
#include <vector>

#include "tests/server/guests/sealed_server.h"

namespace tendon {
namespace {

using std::chrono::milliseconds;
using Kind = HapticOrder::Kind;

/// A server whose device has a lamp and something that vibrates.
class Outputs : public SealedServer {
 protected:
  Outputs() { restart(config()); }

  NetworkLoop::Config config() const {
    NetworkLoop::Config config;
    config.keys = {wall_, other_, screen_};
    config.devices = {{.name = "left", .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}}};
    config.handles = {
        {.outputs = {{.name = "ring", .kind = OutputKind::kLamp}, {.name = "tip", .kind = OutputKind::kVibration}}}};
    return config;
  }

  Client wanting(const std::optional<ClientKey>& key, const std::string& address) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    ForceClient::Config config = config_of(key, ++seed_);
    config.outputs = true;
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config, [](const DeviceState&) { return Touch(Vec3(1, 0, 0)); }, now_);
    return client;
  }

  /// What the device's loop has been told since the last call, of outputs only.
  std::vector<HapticOrder> settings() const {
    std::vector<HapticOrder> found;
    for (; mail_->orders.front() != nullptr; mail_->orders.pop()) {
      if (mail_->orders.front()->kind == Kind::kOutput) found.push_back(*mail_->orders.front());
    }
    return found;
  }

  /// The answer to that request.
  Session::RequestAnswered asked(Client& client, std::uint32_t output, const OutputSetting& setting) {
    EXPECT_TRUE(client.client->set_output(output, setting));
    run(milliseconds(50), {&client});
    EXPECT_TRUE(client.client->order_answer());
    return client.client->order_answer().value_or(Session::RequestAnswered{});
  }
};

TEST_F(Outputs, AreDescribedToAClientThatAsksForThemAndToNoOther) {
  Client wants = wanting(wall_, "192.0.2.1:4000");
  Client plain = observer(screen_, "192.0.2.2:4000");
  run(milliseconds(500), {&wants, &plain});
  ASSERT_TRUE(wants.client->handle() && plain.client->handle());
  EXPECT_EQ(wants.client->handle()->outputs, config().handles[0].outputs);
  EXPECT_TRUE(plain.client->handle()->outputs.empty());
}

TEST_F(Outputs, ASettingOfTheHolderReachesTheLoopOfTheDevice) {
  Client a = wanting(wall_, "192.0.2.1:4000");
  run(milliseconds(300), {&a});
  EXPECT_EQ(asked(a, 0, LampColour{0x00FF00}).code, Code::kOk);
  const Vibration pulse{.amplitude = 0.5, .frequency = 200, .duration = milliseconds(40)};
  EXPECT_EQ(asked(a, 1, pulse).code, Code::kOk);
  const auto told = settings();
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].setting, OutputSetting(LampColour{0x00FF00}));
  EXPECT_EQ(told[1].output, 1U);
  EXPECT_EQ(told[1].setting, OutputSetting(pulse));
}

TEST_F(Outputs, AreRefusedInWordsWhenTheyAreNotThereOrOfAnotherKind) {
  Client a = wanting(wall_, "192.0.2.1:4000");
  run(milliseconds(300), {&a});
  const std::vector<std::pair<std::pair<std::uint32_t, OutputSetting>, std::string>> cases = {
      {{2, LampColour{1}}, "the device has 2 outputs"},
      {{0, Vibration{.amplitude = 1}}, "output 0 is a lamp: expected rgb"},
      {{1, LampColour{1}}, "output 1 vibrates: expected vibration"},
  };
  for (const auto& [wanted, words] : cases) {
    const auto answer = asked(a, wanted.first, wanted.second);
    EXPECT_EQ(answer.code, Code::kInvalid);
    EXPECT_EQ(answer.detail, words);
  }
  EXPECT_TRUE(settings().empty());
}

TEST_F(Outputs, AreNotSetByAClientThatDoesNotHoldTheDevice) {
  Client holder = wanting(wall_, "192.0.2.1:4000");
  run(milliseconds(300), {&holder});
  Client second = wanting(other_, "192.0.2.2:4000");
  run(milliseconds(100), {&holder, &second});
  if (second.client->set_output(0, LampColour{1})) run(milliseconds(50), {&holder, &second});
  EXPECT_TRUE(settings().empty());
  ASSERT_TRUE(holder.client->set_output(0, LampColour{1}));
  run(milliseconds(50), {&holder, &second});
  EXPECT_EQ(settings().size(), 1U);
}

TEST_F(Outputs, ASettingOutOfBoundsIsNotSent) {
  Client a = wanting(wall_, "192.0.2.1:4000");
  run(milliseconds(300), {&a});
  EXPECT_FALSE(a.client->set_output(8, LampColour{1}));
  EXPECT_FALSE(a.client->set_output(0, LampColour{0x1000000}));
  EXPECT_FALSE(a.client->set_output(1, Vibration{.amplitude = 1.5}));
  Client plain = controller(other_, "192.0.2.2:4000");
  EXPECT_FALSE(plain.client->set_output(0, LampColour{1})) << "it did not ask for outputs";
}

}  // namespace
}  // namespace tendon
