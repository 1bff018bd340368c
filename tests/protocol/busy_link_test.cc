// SPDX-License-Identifier: Apache-2.0
#include "protocol/busy_link.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <deque>
#include <vector>

namespace tendon::busy_link_test {
namespace {

using std::chrono::microseconds;

const Address kPeer = parse_address("127.0.0.1:5");

/// Datagrams are identified by their size. The clock is advanced slightly by each query.
class Queue : public Link {
 public:
  void send(const Address& /*to*/, std::span<const std::byte> /*datagram*/) override { ++sent; }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    ++asked;
    clock += took;
    if (sizes.empty()) return 0;
    const std::size_t size = sizes.front();
    sizes.pop_front();
    from = kPeer;
    std::fill_n(buffer.begin(), std::min(size, buffer.size()), static_cast<std::byte>(size));
    return size;
  }
  LocalTime present(LocalTime now) const override { return std::max(now, clock); }
  LocalTime reached(LocalTime now) const override { return now - waited; }

  std::deque<std::size_t> sizes;
  int asked = 0;
  int sent = 0;
  LocalTime clock{std::chrono::seconds(1)};
  Duration took = microseconds(1);
  Duration waited{};
};

struct Received {
  std::size_t size = 0;
  Address from;
  std::array<std::byte, kMaxDatagram> bytes{};
};
Received receive(Link& link) {
  Received all;
  all.size = link.receive(all.from, all.bytes);
  return all;
}

TEST(BusyLink, HandsOutWhatTheLookHasTaken) {
  Queue queue;
  BusyLink busy(queue);
  LocalTime now{};
  EXPECT_FALSE(busy.look(now));
  EXPECT_EQ(now, queue.clock);
  queue.sizes = {40};
  EXPECT_TRUE(busy.look(now));
  EXPECT_TRUE(busy.look(now)) << "it is there until it is received";
  const Received got = receive(busy);
  EXPECT_EQ(got.size, 40U);
  EXPECT_EQ(got.from, kPeer);
  EXPECT_EQ(got.bytes[39], std::byte{40});
  EXPECT_EQ(got.bytes[40], std::byte{0});
  EXPECT_FALSE(busy.look(now));
}

TEST(BusyLink, AsksNoSecondTimeAfterADatagramThatCameAlone) {
  Queue queue;
  BusyLink busy(queue);
  LocalTime now = queue.clock;
  busy.look(now);
  queue.sizes = {40};
  ASSERT_TRUE(busy.look(now));
  const int asked = queue.asked;
  EXPECT_EQ(receive(busy).size, 40U);
  EXPECT_EQ(receive(busy).size, 0U);
  EXPECT_EQ(queue.asked, asked) << "the answer leaves without a further system call";
  queue.sizes = {50};
  EXPECT_EQ(receive(busy).size, 50U) << "but one turn only ends so";
}

TEST(BusyLink, AfterAPauseItAsksForAllThatHasComeMeanwhile) {
  Queue queue;
  BusyLink busy(queue);
  for (const bool before_its_clock_was_read : {false, true}) {
    LocalTime now = queue.clock;
    if (before_its_clock_was_read) queue.took = microseconds(21);  // the thread was preempted
    busy.look(now);
    queue.took = microseconds(1);
    queue.sizes = {40, 50, 60};
    if (!before_its_clock_was_read) queue.clock += microseconds(21);
    ASSERT_TRUE(busy.look(now));
    std::vector<std::size_t> sizes;
    while (const std::size_t size = receive(busy).size) sizes.push_back(size);
    EXPECT_EQ(sizes, (std::vector<std::size_t>{40, 50, 60})) << "in their order, and none is left behind";
  }
}

TEST(BusyLink, WhatALookHasTakenHadComeByThenAndAllElseByNow) {
  Queue queue;
  BusyLink busy(queue);
  LocalTime now = queue.clock;
  queue.sizes = {40, 50};
  ASSERT_TRUE(busy.look(now));
  const LocalTime looked = now;
  EXPECT_EQ(looked, queue.clock);
  queue.clock += microseconds(5);
  ASSERT_EQ(receive(busy).size, 40U);
  EXPECT_EQ(busy.arrived(now), looked) << "no further reading of the clock";
  EXPECT_EQ(busy.arrived(looked + microseconds(2)), looked + microseconds(2)) << "never before what a turn believes";
  EXPECT_EQ(busy.present(now), queue.clock);
  ASSERT_EQ(receive(busy).size, 50U);
  EXPECT_EQ(busy.arrived(now), queue.clock);
}

TEST(BusyLink, KnowsWhenTheDatagramOfALookHasReachedTheMachine) {
  Queue queue;
  queue.waited = microseconds(30);
  BusyLink busy(queue);
  LocalTime now = queue.clock;
  queue.sizes = {40};
  ASSERT_TRUE(busy.look(now));
  queue.clock += microseconds(5);
  ASSERT_EQ(receive(busy).size, 40U);
  EXPECT_EQ(busy.reached(busy.arrived(now)), now - queue.waited);
}

TEST(BusyLink, TellsTheFullSizeOfADatagramThatIsCut) {
  Queue queue;
  BusyLink busy(queue);
  LocalTime now{};
  queue.sizes = {1500};
  ASSERT_TRUE(busy.look(now));
  EXPECT_EQ(receive(busy).size, 1500U);
}

TEST(BusyLink, SendsAtOnceAndReceivesWithoutALook) {
  Queue queue;
  BusyLink busy(queue);
  busy.send(kPeer, {});
  EXPECT_EQ(queue.sent, 1);
  queue.sizes = {40};
  EXPECT_EQ(receive(busy).size, 40U);
  EXPECT_EQ(receive(busy).size, 0U);
}

}  // namespace
}  // namespace tendon::busy_link_test
