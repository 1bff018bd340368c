// SPDX-License-Identifier: Apache-2.0
#include "devices/usb/dialogue.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

namespace tendon::usb::dialogue_test {
namespace {

using namespace std::chrono_literals;
using Packet = std::vector<std::uint8_t>;

struct Cable final : Pipe {
  std::uint32_t connection() noexcept override { return number; }
  bool request(const Request&) noexcept override { return false; }
  bool write(std::span<const std::uint8_t> bytes) noexcept override {
    if (!full) written.emplace_back(bytes.begin(), bytes.end());
    return !full;
  }
  bool settled() const noexcept override { return true; }
  std::size_t read(std::span<std::uint8_t, kPacketSize> packet) noexcept override {
    if (waiting.empty()) return 0;
    const Packet next = std::exchange(waiting.front(), {});
    waiting.erase(waiting.begin());
    std::copy(next.begin(), next.end(), packet.begin());
    return next.size();
  }
  void reopen() noexcept override { ++number; }

  std::uint32_t number = 1;
  bool full = false;
  std::vector<Packet> written;
  std::vector<Packet> waiting;
};

constexpr std::array<std::uint8_t, 1> kRequest = {7};
constexpr Duration kWatchdog = 500ms;

struct Bench {
  explicit Bench(const Dialogue::Patience& patience = {}, Duration watchdog = kWatchdog)
      : cable(new Cable), dialogue(std::unique_ptr<Pipe>(cable), watchdog) {
    dialogue.begin(now);
    dialogue.restart(patience);
  }
  void turn(Duration after = 1ms) { dialogue.begin(now += after); }
  bool ask(bool exerts) { return dialogue.may_send(exerts) && dialogue.send(kRequest, exerts); }
  void answer() {
    dialogue.hear();
    dialogue.believe();
  }
  std::uint64_t count(DeviceCount which) const { return dialogue.counts()[which]; }

  LocalTime now{Duration(3s)};
  Cable* cable;
  Dialogue dialogue;
};

TEST(Dialogue, AnotherConnectionIsSaidOnce) {
  Bench bench;
  EXPECT_FALSE(bench.dialogue.begin(bench.now));
  for (const std::uint32_t number : {0U, 5U, 6U}) {
    bench.cable->number = number;
    EXPECT_TRUE(bench.dialogue.begin(bench.now));
    EXPECT_EQ(bench.dialogue.connected(), number != 0);
    EXPECT_FALSE(bench.dialogue.begin(bench.now));
  }
}

TEST(Dialogue, EveryPacketIsHandedOverInOrder) {
  Bench bench;
  bench.cable->waiting = {{1, 2}, {3}};
  std::vector<Packet> taken;
  bench.dialogue.receive(
      [&](std::span<const std::uint8_t> packet) { taken.emplace_back(packet.begin(), packet.end()); });
  EXPECT_EQ(taken, (std::vector<Packet>{{1, 2}, {3}}));
}

TEST(Dialogue, NoMoreRequestsAreUnderWayThanItIsAllowed) {
  for (const int most : {1, 2, 3}) {
    Bench bench({.most_under_way = most, .answer = 100ms});
    int sent = 0;
    for (int i = 0; i < 5; ++i, bench.turn()) sent += bench.ask(true) ? 1 : 0;
    EXPECT_EQ(sent, most);
    bench.answer();  // all of them
    EXPECT_FALSE(bench.dialogue.awaits_answer());
    for (int i = 0; i < 5; ++i, bench.turn()) sent += bench.ask(true) ? 1 : 0;
    EXPECT_EQ(sent, 2 * most);
  }
}

TEST(Dialogue, ALateAnswerIsAskedForAgainAndCounted) {
  Bench bench({.most_under_way = 2, .answer = 5ms});
  bench.answer();
  ASSERT_TRUE(bench.ask(true));
  bench.turn();
  ASSERT_TRUE(bench.ask(true));
  bench.turn(3ms);
  EXPECT_FALSE(bench.ask(true));
  bench.turn();  // 5 ms after the first request
  EXPECT_TRUE(bench.ask(true));
  EXPECT_EQ(bench.count(DeviceCount::kUnanswered), 1U);
  bench.turn();
  EXPECT_TRUE(bench.ask(true)) << "the two before are taken for lost";
  EXPECT_EQ(bench.count(DeviceCount::kUnanswered), 1U);
}

TEST(Dialogue, WhoeverHasNotAnsweredYetIsStartingAndNotLate) {
  Bench bench;
  for (int i = 0; i < 100; ++i, bench.turn()) bench.ask(false);
  EXPECT_EQ(bench.cable->written.size(), 20U);
  EXPECT_EQ(bench.count(DeviceCount::kUnanswered), 0U);
  bench.answer();
  for (int i = 0; i < 6; ++i, bench.turn()) bench.ask(false);
  EXPECT_EQ(bench.count(DeviceCount::kUnanswered), 1U);
  bench.dialogue.restart({});
  for (int i = 0; i < 6; ++i, bench.turn()) bench.ask(false);
  EXPECT_EQ(bench.count(DeviceCount::kUnanswered), 1U) << "another connection, which has not answered either";
}

TEST(Dialogue, ARequestThatEndsAForceWaitsForNothing) {
  Bench bench;
  ASSERT_TRUE(bench.ask(true));
  bench.turn();
  EXPECT_FALSE(bench.dialogue.may_send(true));
  EXPECT_TRUE(bench.ask(false));
  EXPECT_FALSE(bench.dialogue.holds_force());
  EXPECT_FALSE(bench.dialogue.may_send(false)) << "the second zero ends nothing";
}

TEST(Dialogue, AFullPipeChangesNothing) {
  Bench bench;
  ASSERT_TRUE(bench.ask(true));
  bench.cable->full = true;
  bench.turn();
  EXPECT_FALSE(bench.ask(false));
  EXPECT_TRUE(bench.dialogue.holds_force()) << "the zero never left";
  EXPECT_TRUE(bench.dialogue.may_send(false));
}

TEST(Dialogue, TheDevicesWatchdogEndsTheForceThatWasSentSoLongAgo) {
  Bench bench({.most_under_way = 2, .answer = 1h});
  ASSERT_TRUE(bench.ask(true));
  bench.turn();
  ASSERT_TRUE(bench.ask(true));  // the newest request counts
  bench.turn(kWatchdog - 1ns);
  EXPECT_TRUE(bench.dialogue.holds_force());
  bench.turn(1ns);
  EXPECT_FALSE(bench.dialogue.holds_force());
  Bench without({}, Duration::zero());
  ASSERT_TRUE(without.ask(true));
  without.turn(1h);
  EXPECT_TRUE(without.dialogue.holds_force()) << "it has none";
}

TEST(Dialogue, AnAnswerThatCannotBeTrueIsHeardButNotTrusted) {
  Bench bench;
  bench.answer();
  bench.turn(9ms);
  EXPECT_TRUE(bench.dialogue.trusted());
  bench.turn(1ms);
  EXPECT_FALSE(bench.dialogue.trusted());
  bench.turn(89ms);
  EXPECT_FALSE(bench.dialogue.silent());
  EXPECT_FALSE(bench.dialogue.lost_count());
  bench.dialogue.hear();
  bench.turn();
  EXPECT_FALSE(bench.dialogue.silent());
  EXPECT_TRUE(bench.dialogue.lost_count());
  EXPECT_EQ(bench.dialogue.since_heard(), 1ms);
  EXPECT_EQ(bench.count(DeviceCount::kAnswers), 1U);
  bench.turn(99ms);
  EXPECT_TRUE(bench.dialogue.silent());
}

TEST(DeviceCounters, HaveNamesOfTheirOwnAndWordsThatFitIntoAReport) {
  std::set<std::string_view> names;
  for (const DeviceCounter& row : kDeviceCounters) {
    EXPECT_TRUE(names.insert(row.name).second) << row.name;
    EXPECT_FALSE(row.meaning.empty()) << row.name;
    EXPECT_LE(row.degraded.size(), 18U) << row.name;
  }
}

}  // namespace
}  // namespace tendon::usb::dialogue_test
