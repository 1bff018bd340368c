// SPDX-License-Identifier: Apache-2.0
#include "protocol/session.h"

#include <gtest/gtest.h>

#include "protocol/limits.h"
#include "protocol/reliable/round_trip.h"
#include "protocol/wire/codec.h"
#include "tests/protocol/two_ends.h"

namespace tendon::session_test {
namespace {

TEST_F(TwoEnds, ARequestIsDeliveredOnceHoweverOftenItComes) {
  const auto id = a_.request(SetStateRate{.hz = 250});
  ASSERT_TRUE(id.has_value());
  const auto first = pull(a_, now_);
  now_ += RoundTrip::kFirstTimeout;
  const auto second = pull(a_, now_);
  deliver(z_, now_, first);
  deliver(z_, now_, second);
  const auto arrived = only<Session::RequestArrived>(z_);
  EXPECT_EQ(arrived.id, *id);
  EXPECT_EQ(std::get<SetStateRate>(arrived.request).hz, 250U);
}

TEST_F(TwoEnds, AnAnswerThatWasLostIsGivenAgainWhenTheRequestComesAgain) {
  const auto id = a_.request(Rearm{});
  deliver(z_, now_, pull(a_, now_));
  ASSERT_EQ(events(z_).size(), 1U);
  z_.answer(*id, Code::kDenied, "only from the controller");
  EXPECT_EQ(pull(z_, now_).size(), 1U);  // lost
  EXPECT_TRUE(pull(z_, now_).empty());

  now_ += RoundTrip::kFirstTimeout;
  EXPECT_EQ(pull(z_, now_).size(), 1U);  // a keep-alive
  deliver(z_, now_, pull(a_, now_));
  EXPECT_TRUE(events(z_).empty());
  EXPECT_LE(z_.next_tick(), now_);
  deliver(a_, now_, pull(z_, now_));
  const auto answered = only<Session::RequestAnswered>(a_);
  EXPECT_EQ(answered.id, *id);
  EXPECT_EQ(answered.code, Code::kDenied);
  EXPECT_EQ(answered.detail, "only from the controller");
}

TEST_F(TwoEnds, AnAnswerBringsADeviceOrHowLongToWait) {
  const auto describe = a_.request(Describe{.device = 1});
  const auto take = a_.request(TakeLease{.device = 1, .channel = 1});
  deliver(z_, now_, pull(a_, now_));
  ASSERT_EQ(events(z_).size(), 2U);
  z_.answer(*describe, examples::description());
  z_.answer(*take, Code::kBusy, "somebody", milliseconds(180) - Duration(1));
  deliver(a_, now_, pull(z_, now_));
  const auto told = events(a_);
  ASSERT_EQ(told.size(), 2U);
  const auto& described = std::get<Session::RequestAnswered>(told[0]);
  EXPECT_EQ(described.code, Code::kOk);
  ASSERT_TRUE(described.device.has_value());
  EXPECT_EQ(described.device->channels.at(1).name, "tissue");
  EXPECT_EQ(std::get<Session::RequestAnswered>(told[1]).wait, milliseconds(180));
}

TEST_F(TwoEnds, RequestsThatOvertakeEachOtherAreDeliveredInOrder) {
  a_.request(SetStateRate{.hz = 1});
  const auto first = pull(a_, now_);
  a_.request(SetStateRate{.hz = 2});
  const auto second = pull(a_, now_);
  deliver(z_, now_, second);
  EXPECT_TRUE(events(z_).empty());
  deliver(z_, now_, first);
  const auto at_z = events(z_);
  ASSERT_EQ(at_z.size(), 2U);
  EXPECT_EQ(std::get<Session::RequestArrived>(at_z[0]).id, 1U);
  EXPECT_EQ(std::get<Session::RequestArrived>(at_z[1]).id, 2U);
}

TEST_F(TwoEnds, AnswersAreToldInTheOrderOfTheRequests) {
  a_.request(Rearm{});
  a_.request(Rearm{});
  deliver(z_, now_, pull(a_, now_));
  events(z_);
  z_.answer(2, Code::kOk, "");
  deliver(a_, now_, pull(z_, now_));
  EXPECT_TRUE(events(a_).empty());
  z_.answer(1, Code::kOk, "");
  deliver(a_, now_, pull(z_, now_));
  const auto at_a = events(a_);
  ASSERT_EQ(at_a.size(), 2U);
  EXPECT_EQ(std::get<Session::RequestAnswered>(at_a[0]).id, 1U);
}

TEST_F(TwoEnds, ASeventeenthOpenRequestIsRefused) {
  for (std::uint32_t i = 0; i < limits::kRequestWindow; ++i) EXPECT_EQ(a_.request(Rearm{}), i + 1);
  EXPECT_FALSE(a_.request(Rearm{}).has_value());
  deliver(z_, now_, pull(a_, now_));
  events(z_);
  z_.answer(1, Code::kOk, "");
  deliver(a_, now_, pull(z_, now_));
  EXPECT_FALSE(a_.request(Rearm{}).has_value());  // the answer was received but not used
  EXPECT_EQ(events(a_).size(), 1U);
  EXPECT_EQ(a_.request(Rearm{}), limits::kRequestWindow + 1);
}

TEST_F(TwoEnds, AnswersThatDoNotFitIntoOneDatagramTakeSeveral) {
  for (std::uint32_t i = 0; i < limits::kRequestWindow; ++i) a_.request(Rearm{});
  deliver(z_, now_, pull(a_, now_));
  events(z_);
  for (std::uint32_t i = 1; i <= limits::kRequestWindow; ++i) {
    z_.answer(i, Code::kInvalid, std::string(limits::kMaxDetail, 'x'));
  }
  z_.send(state(1));
  const auto datagrams = pull(z_, now_);
  EXPECT_EQ(datagrams.size(), 3U);
  deliver(a_, now_, datagrams);
  EXPECT_EQ(events(a_).size(), limits::kRequestWindow + 1);
}

TEST_F(TwoEnds, TheWaitForAnAnswerDoublesUpToASecond) {
  a_.request(Rearm{});
  std::vector<Duration> waits;
  LocalTime last = now_;
  pull(a_, now_);
  for (int sent = 1; sent < 7;) {
    now_ += milliseconds(10);
    DataReader reader;
    for (const Bytes& datagram : pull(a_, now_)) {
      if (reader.read(std::span(datagram).subspan(kHeaderSize))->frames.empty()) continue;  // keep-alive
      waits.push_back(now_ - last);
      last = now_;
      ++sent;
    }
  }
  EXPECT_EQ(waits, (std::vector<Duration>{milliseconds(100), milliseconds(200), milliseconds(400), milliseconds(800),
                                          seconds(1), seconds(1)}));
}

TEST_F(TwoEnds, ARequestOfANewerPeerIsAnsweredUnsupported) {
  const RawProtobuf unknown = RawProtobuf().varint(1, 1).text(100, "new");
  pull(z_, now_);
  z_.receive(now_, raw(0, RawProtobuf().fixed64(1, 1).message(3, RawProtobuf().message(3, unknown))));
  EXPECT_TRUE(pull(z_, now_).empty()) << "nobody has asked for it yet";
  EXPECT_TRUE(events(z_).empty());
  const auto datagrams = pull(z_, now_);
  ASSERT_EQ(datagrams.size(), 1U);
  DataReader reader;
  const auto* content = reader.read(std::span(datagrams[0]).subspan(kHeaderSize));
  ASSERT_EQ(content->frames.size(), 1U);
  EXPECT_EQ(std::get<ControlAck>(content->frames[0]).code, Code::kUnsupported);
}

// Regression: the request was never answered, so later requests, including Disarm, were not delivered.
TEST_F(TwoEnds, ARequestOutOfBoundsIsAnsweredAndTheNextIsDelivered) {
  const auto bad = a_.request(SetScale{.device = 1, .position_scale = 0.001});
  const auto disarm = a_.request(Disarm{.device = 1});
  deliver(z_, now_, pull(a_, now_));
  EXPECT_EQ(z_.stats().invalid, 1U);
  const auto asked = only<Session::RequestArrived>(z_);
  EXPECT_EQ(asked.id, *disarm);
  EXPECT_TRUE(std::holds_alternative<Disarm>(asked.request));
  z_.answer(asked.id, Code::kOk, "");
  deliver(a_, now_, pull(z_, now_));
  const auto at_a = events(a_);
  ASSERT_EQ(at_a.size(), 2U);
  const auto& refused = std::get<Session::RequestAnswered>(at_a[0]);
  EXPECT_EQ(refused.id, *bad);
  EXPECT_EQ(refused.code, Code::kInvalid);
  EXPECT_EQ(refused.detail, "position_scale is out of bounds");
  EXPECT_EQ(std::get<Session::RequestAnswered>(at_a[1]).code, Code::kOk);
}

TEST_F(TwoEnds, AnAnswerOutOfBoundsIsAnAnswerAndTheNextIsTold) {
  a_.request(Describe{});
  a_.request(Disarm{});
  deliver(z_, now_, pull(a_, now_));
  EXPECT_EQ(events(z_).size(), 2U);
  z_.answer(1, DeviceDescription{.position_dof = 7, .loop_hz = 1000, .channels = {{.name = "main"}}});
  z_.answer(2, Code::kOk, "");
  deliver(a_, now_, pull(z_, now_));
  EXPECT_EQ(a_.stats().invalid, 1U);
  const auto at_a = events(a_);
  ASSERT_EQ(at_a.size(), 2U);
  const auto& described = std::get<Session::RequestAnswered>(at_a[0]);
  EXPECT_EQ(described.code, Code::kInvalid);
  EXPECT_FALSE(described.device.has_value());
  EXPECT_EQ(std::get<Session::RequestAnswered>(at_a[1]).code, Code::kOk);
}

TEST_F(TwoEnds, RequestsAndAnswersThatACorrectPeerCannotSendAreCounted) {
  z_.receive(now_, examples::data(0, {}, Control{.id = limits::kRequestWindow + 1, .request = Rearm{}}));
  EXPECT_EQ(z_.stats().invalid, 1U);
  z_.receive(now_, examples::data(1, {}, ControlAck{.id = 1, .code = Code::kOk, .detail = ""}));
  EXPECT_EQ(z_.stats().invalid, 2U);
  z_.receive(now_, examples::data(2, {}, Control{.id = 1, .request = Rearm{}}));
  EXPECT_EQ(events(z_).size(), 1U);
  z_.receive(now_, examples::data(3, {}, Control{.id = 17, .request = Rearm{}}));  // request 1 is still unanswered
  EXPECT_EQ(z_.stats().invalid, 3U);
  EXPECT_TRUE(events(z_).empty());
}

TEST_F(TwoEnds, AnAnswerToWhatWasNotAskedIsIgnored) {
  pull(z_, now_);
  z_.answer(1, Code::kOk, "");
  z_.answer(0, Code::kOk, "");
  EXPECT_TRUE(pull(z_, now_).empty());
}

}  // namespace
}  // namespace tendon::session_test
