// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <map>
#include <string>
#include <vector>

#include "protocol/wire/codec.h"
#include "tests/protocol/examples.h"
#include "tests/server/clients/sealed_server.h"

namespace tendon::fields_test {
namespace {

using std::chrono::milliseconds;

class ServerWithoutFields : public SealedServer {
 protected:
  ServerWithoutFields() { restart_without_keys(); }
};

// The engine sends the frames 11 to 13 and the requests 16 to 18, which are used for fields.
TEST_F(ServerWithoutFields, DeniesTheFeatureAndRefusesItsRequests) {
  Foreign engine(wire_, "127.0.0.1:4000", server_,
                 {.role = Role::kController, .name = "engine", .features = {"fields", "local-model"}}, now_);
  int states = 0;
  const auto count = [&](const Session::Event& event) {
    states += std::holds_alternative<Session::StateArrived>(event);
  };
  run_with(engine, milliseconds(50), count);
  ASSERT_TRUE(engine.session());
  EXPECT_EQ(engine.welcome.value().features, std::vector<std::string>{"local-model"});

  std::uint64_t number = engine.session()->stats().datagrams_sent + 10;
  const auto send = [&](const auto& frame) {
    std::array<std::byte, kMaxDatagram> buffer{};
    DataWriter writer;
    writer.begin(buffer, {.connection_id = engine.session()->connection_id(), .packet_number = number++},
                 LocalTime{Duration{1}}, {});
    ASSERT_TRUE(writer.add(frame));
    deliver(engine.end.self, Bytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(writer.size())));
  };
  send(examples::field_brick());
  send(examples::field_status());
  send(examples::field_pose());
  send(Control{.id = 1, .request = examples::offer_field()});
  send(Control{.id = 2, .request = examples::use_field()});
  send(Control{.id = 3, .request = examples::drop_field()});
  states = 0;
  const std::size_t before = wire_.size();
  run_with(engine, milliseconds(50), count);
  EXPECT_EQ(stats().malformed + stats().dropped.malformed + stats().dropped.invalid, 0U);
  EXPECT_GT(states, 40);
  EXPECT_FALSE(engine.refused);

  std::map<std::uint32_t, Code> answers;
  DataReader reader;
  for (std::size_t i = before; i < wire_.size(); ++i) {
    if (wire_[i].to != engine.end.self) continue;
    const DataContent* const content = reader.read(std::span(wire_[i].bytes).subspan(kHeaderSize));
    ASSERT_TRUE(content);
    for (const Frame& frame : content->frames) {
      if (const auto* ack = std::get_if<ControlAck>(&frame)) answers[ack->id] = ack->code;
    }
  }
  EXPECT_EQ(answers,
            (std::map<std::uint32_t, Code>{{1, Code::kUnsupported}, {2, Code::kUnsupported}, {3, Code::kUnsupported}}));

  engine.session()->send(
      ForceCommand{.sequence = 1, .based_on_tick = tick_, .force = Vec3(1, 0, 0), .valid_for = milliseconds(20)});
  run_with(engine, milliseconds(5), count);
  const RemoteForce* const force = mail().forces[0].take();
  ASSERT_TRUE(force);
  EXPECT_EQ(force->force, Vec3(1, 0, 0));
}

}  // namespace
}  // namespace tendon::fields_test
