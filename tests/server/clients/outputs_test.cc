// SPDX-License-Identifier: Apache-2.0
#include "server/clients/outputs.h"

#include <string>
#include <utility>
#include <vector>

#include "tests/server/clients/sealed_server.h"

namespace tendon::outputs_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Vibration kPulse{.amplitude = 0.5, .frequency = 200, .duration = milliseconds(40)};

/// The device "right" has two channels and three outputs, which are a lamp, a vibrator and another lamp.
class OutputsOfADevice : public TwoDevices {
 protected:
  OutputsOfADevice() {
    scenes_[1].channels = {{.name = "guidance", .lease = seconds(1)}, {.name = "tissue"}};
    handle_ = HandleDescription{.outputs = outputs_};
    restart();
    run(milliseconds(300), {&a});
  }

  Client wanting(const ClientKey& key, const std::string& address, const std::string& channel, bool outputs = true) {
    return controller(key, address, {.device = "right", .channel = channel, .outputs = outputs});
  }

  OutputSetting told(std::size_t output) {
    if (const OutputSettings* const news = mail(1).outputs.take()) newest_ = *news;
    return newest_.of[output].setting;
  }

  Session::RequestAnswered asked(Client& client, std::uint32_t output, const OutputSetting& setting) {
    EXPECT_TRUE(client->set_output(output, setting));
    run(milliseconds(50), {&client});
    EXPECT_TRUE(client->order_answer());
    return client->order_answer().value_or(Session::RequestAnswered{});
  }

  const std::vector<OutputDescription> outputs_ = {{.name = "ring", .kind = OutputKind::kLamp},
                                                   {.name = "tip", .kind = OutputKind::kVibration},
                                                   {.name = "base", .kind = OutputKind::kLamp}};
  OutputSettings newest_;
  Client a = wanting(wall_, "192.0.2.1:4000", "guidance");
};

TEST_F(OutputsOfADevice, AreDescribedToAClientThatAsksForThemAndToNoOther) {
  Client plain = wanting(other_, "192.0.2.2:4000", "tissue", false);
  run(milliseconds(500), {&a, &plain});
  ASSERT_TRUE(a->handle() && plain->handle());
  EXPECT_EQ(a->handle()->outputs, outputs_);
  EXPECT_TRUE(plain->handle()->outputs.empty());
  EXPECT_FALSE(plain->set_output(0, LampColour{1})) << "it did not ask for outputs";
}

TEST_F(OutputsOfADevice, ASettingOfAHolderReachesTheLoopOfTheDevice) {
  EXPECT_EQ(asked(a, 0, LampColour{0x00FF00}).code, Code::kOk);
  EXPECT_EQ(asked(a, 1, kPulse).code, Code::kOk);
  EXPECT_EQ(told(0), OutputSetting(LampColour{0x00FF00}));
  EXPECT_EQ(told(1), OutputSetting(kPulse));
}

TEST_F(OutputsOfADevice, AreRefusedInWordsWhenTheyAreNotThereOrOfAnotherKind) {
  const std::vector<std::pair<std::pair<std::uint32_t, OutputSetting>, std::string>> cases = {
      {{3, LampColour{1}}, "the device has 3 outputs"},
      {{0, kPulse}, "output 0 is a lamp: expected rgb"},
      {{1, LampColour{1}}, "output 1 is a vibration output: expected vibration"},
  };
  for (const auto& [wanted, words] : cases) {
    const auto answer = asked(a, wanted.first, wanted.second);
    EXPECT_EQ(answer.code, Code::kInvalid);
    EXPECT_EQ(answer.detail, words);
  }
  EXPECT_EQ(mail(1).outputs.take(), nullptr);
}

TEST_F(OutputsOfADevice, AreNotSetByAClientThatWaitsForTheLease) {
  Client second = wanting(other_, "192.0.2.2:4000", "guidance");
  run(milliseconds(300), {&a, &second});
  ASSERT_TRUE(second->set_output(0, LampColour{1}));
  run(milliseconds(50), {&a, &second});
  ASSERT_TRUE(second->order_answer());
  EXPECT_EQ(second->order_answer()->code, Code::kDenied);
  EXPECT_EQ(second->order_answer()->detail, "only the holder of a channel of the device may set an output");
  EXPECT_EQ(mail(1).outputs.take(), nullptr);
}

TEST_F(OutputsOfADevice, AreOffWhenTheClientThatSetThemGoesAndTheOthersStay) {
  Client b = wanting(other_, "192.0.2.2:4000", "tissue");
  run(milliseconds(300), {&a, &b});
  ASSERT_TRUE(a->set_output(0, LampColour{1}) && a->set_output(1, kPulse));
  ASSERT_TRUE(b->set_output(2, LampColour{2}));
  run(milliseconds(50), {&a, &b});
  EXPECT_EQ(told(0), OutputSetting(LampColour{1}));
  a->stop(now_);
  run(milliseconds(50), {&a, &b});
  EXPECT_EQ(told(0), OutputSetting(LampColour{}));
  EXPECT_EQ(told(1), OutputSetting(Vibration{}));
  EXPECT_EQ(told(2), OutputSetting(LampColour{2})) << "another's";
  ASSERT_TRUE(b->give_lease());
  run(milliseconds(50), {&b});
  EXPECT_EQ(told(2), OutputSetting(LampColour{}));
}

TEST_F(OutputsOfADevice, AreOffWhenItIsDisarmed) {
  EXPECT_EQ(asked(a, 0, LampColour{1}).code, Code::kOk);
  ASSERT_TRUE(a->disarm());
  run(milliseconds(50), {&a});
  EXPECT_EQ(told(0), OutputSetting(LampColour{}));
}

TEST_F(OutputsOfADevice, AFloodOfSettingsLeavesRoomForTheOrderToDisarm) {
  Client b = wanting(other_, "192.0.2.2:4000", "tissue");
  run(milliseconds(300), {&a, &b});
  int asked = 0;
  while (a->set_output(0, LampColour{1})) ++asked;
  EXPECT_EQ(asked, 16);
  run(milliseconds(10), {&a});
  ASSERT_TRUE(b->disarm());
  run(milliseconds(50), {&a, &b});
  EXPECT_EQ(b->order_answer()->code, Code::kOk);
}

TEST_F(OutputsOfADevice, ASettingOutOfBoundsIsNotSent) {
  EXPECT_FALSE(wanting(other_, "192.0.2.2:4000", "tissue")->set_output(0, LampColour{1})) << "there is no session yet";
  EXPECT_FALSE(a->set_output(8, LampColour{1}));
  EXPECT_FALSE(a->set_output(0, LampColour{0x1000000}));
  EXPECT_FALSE(a->set_output(1, Vibration{.amplitude = 1.5}));
  EXPECT_TRUE(a->set_output(0, LampColour{1}));
}

}  // namespace
}  // namespace tendon::outputs_test
