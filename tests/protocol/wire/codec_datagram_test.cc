// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "protocol/limits.h"
#include "protocol/secrets/crypto.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/read_back.h"

namespace tendon::codec_datagram_test {
namespace {

using examples::data;

/// These sizes include the tag of suite 1 and an echo.
TEST(Codec, APortTakes238BytesAndAtMost609AndFitsBesideAState) {
  const auto sealed = [](const auto&... frames) {
    return data(1'000'000, examples::echo(), frames...).size() + crypto::kTagSize;
  };
  PortFrame usual = examples::port();
  usual.position = usual.velocity = usual.force = {0.1, -0.2, 0.3};
  EXPECT_EQ(sealed(usual), 238U);

  PortFrame most = usual;
  most.device = limits::kMaxDevices - 1;
  most.channel = limits::kMaxChannels - 1;
  most.epoch = most.sequence = most.answers_epoch = most.answers = most.engagement = ~std::uint64_t{0};
  most.round_trip = PortState::kMostRoundTrip;
  most.contact_force = Vec3(0.1, -0.2, 0.3);
  most.wave_integral = {0.1, -0.2, 0.3};
  most.wave_energy = 0.1;
  most.surface = {.normal = {0.36, 0.48, 0.8}, .offset = 0.1, .stiffness = 0.1};
  most.turn = {.turn = {.w = 0.4, .x = 0.4, .y = 0.2, .z = -0.8},
               .angular_velocity = {0.1, -0.2, 0.3},
               .torque = {0.1, -0.2, 0.3}};
  most.grip = {.opening = 0.1, .velocity = 0.1, .force = 0.1, .account = 0.1, .need = 0.1, .given = 0.1, .taken = 0.1};
  most.energy_in = most.position_scale = most.force_scale = 0.1;
  most.share = 0;
  most.of_peer = true;
  EXPECT_EQ(sealed(most), 609U);
  EXPECT_LE(sealed(examples::state_with_handle(), most), kMaxDatagram);
}

TEST(Codec, SeveralFramesAndAnEchoShareOneDatagram) {
  DataReader reader;
  const auto* content = read(reader, data(42, examples::echo(), examples::state(), examples::force(),
                                          Control{.id = 1, .request = Rearm{}}, Bye{.code = Code::kOk, .reason = "x"}));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 4U);
  EXPECT_EQ(std::get<DeviceState>(content->frames[0]).tick, 1000U);
  EXPECT_EQ(std::get<ForceCommand>(content->frames[1]).sequence, 100U);
  EXPECT_TRUE(std::holds_alternative<Rearm>(*std::get<Control>(content->frames[2]).request));
  EXPECT_EQ(std::get<Bye>(content->frames[3]).reason, "x");
  EXPECT_EQ(content->sent, PeerTime{Duration{1'000'100'000}});
  ASSERT_TRUE(content->echo.has_value());
  EXPECT_EQ(content->echo->sent, LocalTime{Duration{5'000'000}});
  EXPECT_EQ(content->echo->received, PeerTime{Duration{999'000'000}});
  EXPECT_EQ(content->echo->packet_number, 3U);
  EXPECT_EQ(content->echo->received_mask, 0b101U);
}

TEST(Codec, AWriterUsedAgainRemembersNothingOfTheLastDatagram) {
  DataWriter writer;
  std::array<std::byte, kMaxDatagram> buffer;
  const auto write = [&](const std::optional<OutgoingEcho>& echo, const auto&... frames) {
    writer.begin(buffer, {.connection_id = examples::kConnection}, LocalTime{Duration{1'000'100'000}}, echo);
    (writer.add(frames), ...);
    return examples::Bytes(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(writer.size()));
  };
  ForceCommand force = examples::force();
  force.model.reset();
  ControlAck ack = examples::handle_described(1);
  ack.handle = HandleDescription{.device = 1};
  write(examples::echo(), examples::state_with_handle(), examples::force_with_torque(), examples::handle_described(1));
  EXPECT_EQ(write({}, examples::state(), force, ack), data(0, {}, examples::state(), force, ack));

  const Control couple{.id = 1, .request = examples::couple()};
  write({}, examples::port_with_all(), Control{.id = 1, .request = examples::couple_with_all()});
  EXPECT_EQ(write({}, examples::port(), couple), data(0, {}, examples::port(), couple));

  const DeviceReport device{.number = 8};
  PeerReport peer;
  peer.link.number = 1;
  write({}, examples::state_with_wanted(), examples::device_report(), examples::peer_report_with_way());
  EXPECT_EQ(write({}, examples::state(), device, peer), data(0, {}, examples::state(), device, peer));
}

TEST(Codec, AReaderUsedAgainRemembersNothingOfTheLastCoupling) {
  DataReader reader;
  read(reader, data(1, {}, examples::port_with_all(), Control{.id = 1, .request = examples::couple_with_all()}));
  const auto* content = read(reader, data(2, {}, examples::port(), Control{.id = 1, .request = examples::couple()}));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 2U);
  const auto& port = std::get<PortFrame>(content->frames[0]);
  EXPECT_FALSE(port.turn || port.grip || port.share || port.of_peer);
  EXPECT_EQ(port.energy_in + port.position_scale + port.force_scale, 0);
  EXPECT_EQ(std::get<Couple>(*std::get<Control>(content->frames[1]).request), examples::couple());
}

TEST(Codec, TheLargestReportsFitIntoASealedDatagramOfTheirOwn) {
  constexpr std::uint64_t kMost = ~std::uint64_t{0};
  LinkReport link;
  link.number = link.forces = link.late_server = link.late_network = link.late_engine = link.late_unknown = kMost;
  link.refused = {.not_finite = kMost, .out_of_bounds = kMost, .unknown_tick = kMost, .old_sequence = kMost};
  link.until = PeerTime{limits::kMaxTime};
  link.span = link.worst_late = link.longest_gap = limits::kMaxTime;
  link.round_trip = link.to_server = link.to_client = Delays{-limits::kMaxTime, -limits::kMaxTime};
  link.clock_offset = -limits::kMaxTime;
  link.clock_drift_ppm = 0.1;
  link.clock_error = limits::kMaxTime;
  link.received = link.lost = link.reordered = link.duplicated = kMost;
  link.words.assign(limits::kMaxDetail, 'w');
  const PeerReport peer{.device = limits::kMaxDevices - 1,
                        .channel = limits::kMaxChannels - 1,
                        .name = std::string(limits::kMaxName, 'n'),
                        .state_one_in = limits::kMaxOneIn,
                        .forces_refused = true,
                        .link = link,
                        .error = limits::kMaxValue,
                        .way = std::string(limits::kMaxLabel, 'y')};
  DeviceReport device{.number = kMost,
                      .until = PeerTime{limits::kMaxTime},
                      .span = limits::kMaxTime,
                      .device = limits::kMaxDevices - 1,
                      .steps = kMost,
                      .missed = kMost,
                      .overruns = kMost,
                      .unseen = kMost};
  device.lateness.fill(kMost / limits::kLatenessBuckets);
  device.safety = Safety::kUnguarded;
  device.fault.assign(limits::kMaxDetail, 'f');
  device.degraded.assign(limits::kMaxDetail, 'd');

  const OutgoingEcho echo{.sent = PeerTime{limits::kMaxTime},
                          .received = LocalTime{limits::kMaxTime},
                          .packet_number = limits::kMaxPacketNumber,
                          .received_mask = 1};
  DataWriter writer;
  std::array<std::byte, kMaxDatagram - 16> buffer;
  for (const bool of_device : {true, false}) {
    writer.begin(buffer, {.connection_id = 1}, LocalTime{limits::kMaxTime}, echo);
    EXPECT_TRUE(of_device ? writer.add(device) : writer.add(peer));
    DataReader reader;
    const auto* content = reader.read(std::span(buffer).first(writer.size()).subspan(kHeaderSize));
    ASSERT_NE(content, nullptr);
    EXPECT_EQ(content->frames.size(), 1U);
  }
}

TEST(Codec, AFrameThatDoesNotFitLeavesTheDatagramAsItWas) {
  DataWriter writer;
  DataReader reader;
  std::array<std::byte, kMaxDatagram> buffer;
  writer.begin(buffer, {.connection_id = 1}, LocalTime{}, {});
  std::size_t fitted = 0;
  while (writer.add(examples::state())) ++fitted;
  EXPECT_LE(writer.size(), kMaxDatagram);
  const auto* content = reader.read(std::span(buffer).first(writer.size()).subspan(kHeaderSize));
  ASSERT_NE(content, nullptr);
  EXPECT_EQ(content->frames.size(), fitted);
}

/// The largest frame does not fit and must not overflow a buffer.
TEST(Codec, AnAnswerWithBothLongestDescriptionsIsRefusedWhole) {
  const std::string longest(24, 'x');
  ControlAck ack{.id = ~0U, .code = Code::kOk, .detail = std::string(128, 'x'), .device = examples::description()};
  ack.device->name = longest;
  ack.device->model = std::string(64, 'x');
  ack.device->channels.assign(
      limits::kMaxChannels,
      {.name = longest, .rule = ChannelRule::kSum, .lease = std::chrono::seconds(10), .holder = longest});
  ack.handle = examples::handle_description();
  ack.handle->buttons.assign(16, longest);
  ack.handle->joints.assign(8, longest);
  ack.handle->group = longest;
  ack.handle->outputs.assign(8, {.name = longest, .kind = OutputKind::kLamp});

  std::array<std::byte, kMaxDatagram> buffer{};
  DataWriter writer;
  writer.begin(buffer, {}, LocalTime{Duration{1}}, {});
  const std::size_t empty = writer.size();
  EXPECT_FALSE(writer.add(ack));
  EXPECT_EQ(writer.size(), empty);
  EXPECT_TRUE(writer.add(examples::state())) << "the next frame fits";
}

}  // namespace
}  // namespace tendon::codec_datagram_test
