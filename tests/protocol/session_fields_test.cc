// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <variant>
#include <vector>

#include "protocol/session.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/two_ends.h"

namespace tendon::session_fields_test {
namespace {

using session_test::deliver;
using session_test::events;
using session_test::only;
using session_test::pull;

class SessionFields : public session_test::TwoEnds {
 protected:
  SessionFields() {
    deliver(z_, now_, pull(a_, now_));
    deliver(a_, now_, pull(z_, now_));
    deliver(z_, now_, pull(a_, now_));
    events(a_);
    events(z_);
  }

  static FieldStatus status(unsigned field) {
    FieldStatus status = examples::field_status();
    status.field.fill(static_cast<std::byte>(field));
    return status;
  }
};

TEST_F(SessionFields, TheNewestPoseOfAChannelWins) {
  FieldPose pose = examples::field_pose();
  a_.send(pose);
  pose.sequence = 9;
  pose.position.x() = 0.25;
  a_.send(pose);
  pose.channel = 0;
  a_.send(pose);
  const auto datagrams = pull(a_, now_);
  EXPECT_EQ(datagrams.size(), 1U);
  deliver(z_, now_, datagrams);
  const auto at_z = events(z_);
  ASSERT_EQ(at_z.size(), 2U);
  EXPECT_EQ(std::get<Session::FieldPoseArrived>(at_z[0]).pose.position.x(), 0.25);
  EXPECT_EQ(std::get<Session::FieldPoseArrived>(at_z[1]).pose.channel, 0U);

  pose.sequence = 8;
  a_.send(pose);
  deliver(z_, now_, pull(a_, now_));
  EXPECT_TRUE(events(z_).empty());
  EXPECT_EQ(z_.stats().stale, 1U);
}

TEST_F(SessionFields, ABrickIsCopiedAndTheNextOneWaitsForItsDatagram) {
  BrickBytes weights = examples::brick_weights();
  const FieldBrick brick{.hash = crypto::blake2b_128(weights), .weights = weights};
  EXPECT_TRUE(a_.send(brick));
  EXPECT_FALSE(a_.send(brick));
  weights.fill(std::byte{0});
  a_.send(examples::force());
  const auto datagrams = pull(a_, now_);
  EXPECT_EQ(datagrams.size(), 1U);
  EXPECT_TRUE(a_.send(brick));
  deliver(z_, now_, datagrams);
  const auto at_z = events(z_);
  ASSERT_EQ(at_z.size(), 2U);
  const FieldBrick& arrived = std::get<Session::BrickArrived>(at_z[1]).brick;
  EXPECT_EQ(arrived.hash, brick.hash);
  EXPECT_TRUE(std::ranges::equal(arrived.weights, examples::brick_weights()));
}

TEST_F(SessionFields, ABrickBesideTheLargestForceTakesASecondDatagram) {
  EXPECT_TRUE(a_.send(examples::field_brick()));
  a_.send(examples::force_with_all());
  const auto datagrams = pull(a_, now_);
  EXPECT_EQ(datagrams.size(), 2U);
  deliver(z_, now_, {datagrams.back()});
  EXPECT_EQ(only<Session::BrickArrived>(z_).brick.hash, examples::field_brick().hash);
}

TEST_F(SessionFields, AnUploadToADeafOwnerKeepsEightStatusesAndOneBrick) {
  for (unsigned i = 1; i <= 100; ++i) {
    z_.send(status(i));
    EXPECT_TRUE(z_.send(examples::field_brick()));
    deliver(a_, now_, pull(z_, now_));
  }
  EXPECT_EQ(events(a_).size(), 9U);
  for (unsigned i = 1; i <= 100; ++i) z_.send(status(i));
  deliver(a_, now_, pull(z_, now_));
  EXPECT_EQ(events(a_).size(), 8U);
}

TEST_F(SessionFields, OfAFieldTheNewestStatusWins) {
  FieldStatus first = status(1);
  z_.send(first);
  const auto late = pull(z_, now_);
  first.missing = {};
  z_.send(first);
  z_.send(status(2));
  deliver(a_, now_, pull(z_, now_));
  deliver(a_, now_, late);
  const auto at_a = events(a_);
  ASSERT_EQ(at_a.size(), 2U);
  EXPECT_EQ(std::get<Session::FieldStatusArrived>(at_a[0]).status.missing, first.missing);
  EXPECT_EQ(std::get<Session::FieldStatusArrived>(at_a[1]).status.field, status(2).field);
  EXPECT_EQ(a_.stats().stale, 1U);
}

TEST_F(SessionFields, ARequestOfAFieldIsReliable) {
  const auto id = a_.request(examples::offer_field());
  ASSERT_TRUE(id);
  pull(a_, now_);  // lost
  now_ += std::chrono::milliseconds(500);
  deliver(z_, now_, pull(a_, now_));
  const auto arrived = only<Session::RequestArrived>(z_);
  EXPECT_EQ(std::get<OfferField>(arrived.request).part, examples::manifest());
  z_.answer(arrived.id, Code::kOk, {});
  deliver(a_, now_, pull(z_, now_));
  EXPECT_EQ(only<Session::RequestAnswered>(a_).id, *id);
}

}  // namespace
}  // namespace tendon::session_fields_test
