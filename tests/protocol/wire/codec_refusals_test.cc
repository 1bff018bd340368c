// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/codec.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/read_back.h"

namespace tendon::codec_refusals_test {
namespace {

using examples::data;

/// The request must be invalid because of `field`, and the state after it must still be read.
void expect_refused(const Request& request, std::string_view field) {
  SCOPED_TRACE(field);
  DataReader reader;
  const auto* content = read(reader, data(1, {}, Control{.id = 7, .request = request}, examples::state()));
  ASSERT_NE(content, nullptr);
  EXPECT_EQ(content->invalid, 1U);
  ASSERT_EQ(content->frames.size(), 2U);
  const auto& control = std::get<Control>(content->frames[0]);
  EXPECT_EQ(control.id, 7U);
  EXPECT_FALSE(control.request.has_value());
  EXPECT_EQ(control.invalid, field);
  EXPECT_TRUE(std::holds_alternative<DeviceState>(content->frames[1]));
}

template <class Message>
Message with(Message message, void (*change)(Message&)) {
  change(message);
  return message;
}

/// vectors_test.cc tests the bounds of single fields.
TEST(Codec, AFrameThatContradictsItselfIsLeftOutAndCountedAndTheNextIsRead) {
  const auto force = [](void (*change)(ForceCommand&)) {
    ForceCommand all = examples::force_with_all();
    all.torque = examples::force_with_torque().torque;
    return with(all, change);
  };
  const auto report = [](void (*change)(DeviceReport&)) { return with(examples::device_report(), change); };
  const std::vector<std::pair<std::string, Frame>> rows = {
      {"no orientation",
       with<DeviceState>(examples::state_with_handle(),
                         [](DeviceState& s) { s.turning->orientation = {.w = 0, .x = 0, .y = 0, .z = 0}; })},
      {"no normal", force([](ForceCommand& f) { f.model->contact->normal.setZero(); })},
      {"valid for 2³² µs + 1 s",
       force([](ForceCommand& f) { f.valid_for = std::chrono::microseconds(4'295'967'296); })},
      {"valid for less than nothing", force([](ForceCommand& f) { f.valid_for = Duration{-1}; })},
      {"more late steps than steps", report([](DeviceReport& r) { r.steps = 986; })},
      {"counts that overflow", report([](DeviceReport& r) { r.lateness[1] = r.lateness[2] = std::uint64_t{1} << 63; })},
      {"more overruns than steps", report([](DeviceReport& r) { r.overruns = r.steps + 1; })},
      {"more unseen than steps", report([](DeviceReport& r) { r.unseen = r.steps + 1; })},
      {"a link out of bounds",
       with<PeerReport>(examples::peer_report(), [](PeerReport& r) { r.link.clock_drift_ppm = kNan; })},
  };
  for (const auto& [what, bad] : rows) {
    SCOPED_TRACE(what);
    const auto datagram = std::visit([](const auto& frame) { return data(1, {}, frame, examples::state()); }, bad);
    DataReader reader;
    const auto* content = read(reader, datagram);
    ASSERT_NE(content, nullptr);
    EXPECT_EQ(content->invalid, 1U);
    ASSERT_EQ(content->frames.size(), 1U);
    EXPECT_TRUE(std::holds_alternative<DeviceState>(content->frames[0]));
  }
}

TEST(Codec, APeerReportNeedsALink) {
  const auto invalid = [](const RawProtobuf& report) {
    DataReader reader;
    return reader.read(datagram_with(RawProtobuf().message(8, report)))->invalid;
  };
  EXPECT_EQ(invalid(RawProtobuf().varint(4, 1).message(6, RawProtobuf().varint(1, 1))), 0U);
  EXPECT_EQ(invalid(RawProtobuf().varint(4, 1)), 1U);
}

TEST(Codec, APulseOfAFrequencyBelow20HzOrALengthBelowZeroIsRefused) {
  const auto pulse = [](double frequency, Duration duration) {
    return SetOutput{
        .device = 1, .output = 1, .setting = Vibration{.amplitude = 1, .frequency = frequency, .duration = duration}};
  };
  using std::chrono::milliseconds;
  expect_refused(pulse(19.9, milliseconds(1)), "vibration.frequency_hz");
  expect_refused(pulse(0, milliseconds(-1)), "vibration.duration_ms");
  expect_refused(pulse(0, std::chrono::seconds(10) + Duration{1}), "vibration.duration_ms");
  EXPECT_EQ(refused_field(pulse(19.9, milliseconds(1))), "vibration.frequency_hz");
}

TEST(Codec, ALimitIsInBoundsForASender) {
  EXPECT_EQ(refused_field(SetScale{.position_scale = 0.01, .force_scale = 100}), "");
  EXPECT_EQ(refused_field(SetShare{.share = 0}), "");
  EXPECT_EQ(refused_field(SetShare{.share = 1}), "");
}

TEST(Codec, ARequestWithoutAnIdIsLeftOutWhateverItHolds) {
  for (const std::uint32_t device : {0U, limits::kMaxDevices}) {
    DataReader reader;
    const auto* content = read(reader, data(1, {}, Control{.id = 0, .request = Disarm{.device = device}}));
    EXPECT_EQ(content->invalid, 1U) << device;
    EXPECT_TRUE(content->frames.empty()) << device;
  }
}

TEST(Codec, ACoupleNeedsARotation) {
  const auto refused = [](bool rotation) {
    constexpr std::uint64_t kOne = 0x3ff0'0000'0000'0000;  // 1.0
    RawProtobuf raw;
    raw.varint(3, 1).varint(4, 1).fixed64(5, kOne).fixed64(6, kOne).varint(8, 7).varint(14, 1000);
    if (rotation) raw.message(7, RawProtobuf().fixed64(1, kOne));
    DataReader reader;
    const auto* content =
        reader.read(datagram_with(RawProtobuf().message(3, RawProtobuf().varint(1, 1).message(11, raw))));
    return std::string(std::get<Control>(content->frames.at(0)).invalid);
  };
  EXPECT_EQ(refused(false), "rotation");
  EXPECT_EQ(refused(true), "");
}

TEST(Codec, ZerosAtTheEndOfAHistogramDoNotTravel) {
  DeviceReport report = examples::device_report();
  const std::size_t before = data(1, {}, report).size();
  std::swap(report.lateness[13], report.lateness[12]);
  EXPECT_EQ(data(1, {}, report).size(), before - 1);
  report.lateness = {};
  EXPECT_EQ(data(1, {}, report).size(), before - 2 - 15);
}

TEST(Codec, ABucketEndsWithItsPowerOfTwo) {
  using std::chrono::microseconds;
  EXPECT_EQ(lateness_bucket(-std::chrono::seconds(1)), 0U);
  EXPECT_EQ(lateness_bucket(Duration{0}), 0U);
  EXPECT_EQ(lateness_bucket(microseconds(1)), 0U);
  EXPECT_EQ(lateness_bucket(microseconds(1) + Duration{1}), 1U);
  for (std::size_t i = 1; i + 1 < limits::kLatenessBuckets; ++i) {
    const Duration end = microseconds(std::int64_t{1} << i);
    EXPECT_EQ(lateness_bucket(end), i);
    EXPECT_EQ(lateness_bucket(end + Duration{1}), i + 1);
  }
  EXPECT_EQ(lateness_bucket(Duration::max()), limits::kLatenessBuckets - 1);
}

TEST(Codec, ADeadbandOfNaNIsRefusedAndASenselessOneIsForTheServer) {
  const auto read_back = [](const SetStateDeadband& asked) -> std::optional<SetStateDeadband> {
    DataReader reader;
    const auto* content = read(reader, data(1, {}, Control{.id = 1, .request = asked}));
    return std::get<SetStateDeadband>(*std::get<Control>(content->frames[0]).request);
  };
  expect_refused(SetStateDeadband{.share = kNan}, "share");
  expect_refused(SetStateDeadband{.floor = kInf}, "floor_mps");
  const auto silly = read_back({.share = -7, .floor = 9, .max_silence = std::chrono::milliseconds(20)});
  EXPECT_EQ(silly->share, -7);
  EXPECT_EQ(silly->floor, 9);
  EXPECT_EQ(silly->max_silence, std::chrono::milliseconds(20));
  for (const Duration impossible : {Duration{-1}, limits::kMaxStateSilence + Duration{1}, Duration::max()}) {
    EXPECT_GT(read_back({.max_silence = impossible})->max_silence, limits::kMaxStateSilence);
  }
}

TEST(Codec, FramesAndRequestsOfANewerPeerAreNoError) {
  DataReader reader;
  const auto* content = reader.read(datagram_with(RawProtobuf().text(100, "what we do not know")));
  ASSERT_NE(content, nullptr);
  EXPECT_EQ(content->invalid, 0U);
  EXPECT_TRUE(content->frames.empty());

  content = reader.read(datagram_with(RawProtobuf().message(3, RawProtobuf().varint(1, 5).text(100, "new"))));
  ASSERT_NE(content, nullptr);
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_EQ(std::get<Control>(content->frames[0]).id, 5U);
  EXPECT_FALSE(std::get<Control>(content->frames[0]).request.has_value());
}

TEST(Codec, TextThatIsNotUtf8MakesADatagramMalformedWithoutAWord) {
  testing::internal::CaptureStderr();
  DataReader reader;
  EXPECT_EQ(reader.read(datagram_with(RawProtobuf().message(5, RawProtobuf().varint(1, 1).text(2, "\xFF")))), nullptr);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Codec, OurOwnTextIsCutToSizeAtACharacterAndWhereItIsNotUtf8) {
  const auto reason = [](const std::string& text) { return there(Bye{.code = Code::kOk, .reason = text}).reason; };
  const std::string full(limits::kMaxDetail, 'x');
  EXPECT_EQ(reason(full), full);
  EXPECT_EQ(reason(full + "y"), full);
  EXPECT_EQ(reason(full.substr(1) + "ä"), full.substr(1));
  EXPECT_EQ(reason("10 µm → ∞ 🙂"), "10 µm → ∞ 🙂");
  EXPECT_EQ(reason("good\xC0\x80"), "good");          // overlong
  EXPECT_EQ(reason("good\xED\xA0\x80"), "good");      // surrogate
  EXPECT_EQ(reason("good\xF4\x90\x80\x80"), "good");  // beyond U+10FFFF
  EXPECT_EQ(reason("good\xE2\x82"), "good");          // truncated
  const DeviceReport wordy = there(DeviceReport{.number = 1, .fault = full + "y", .degraded = full + "y"});
  EXPECT_EQ(wordy.fault, full);
  EXPECT_EQ(wordy.degraded, full);
  LinkReport report = examples::report();
  report.words = full + "y";
  EXPECT_EQ(there(report).words, full);
}

}  // namespace
}  // namespace tendon::codec_refusals_test
