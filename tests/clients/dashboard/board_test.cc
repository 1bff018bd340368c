// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/board.h"

#include <gtest/gtest.h>

#include <string>

#include "core/base/reason.h"
#include "tests/clients/dashboard/full_board.h"

namespace tendon::dash::board_test {
namespace {

DeviceState state(std::uint64_t tick, std::uint32_t device = 0) {
  DeviceState made;
  made.tick = tick;
  made.device = device;
  return made;
}

PeerReport engine(const std::string& name, std::uint64_t forces) {
  PeerReport report;
  report.name = name;
  report.link.forces = forces;
  report.link.late_network = 1;
  return report;
}

TEST(Board, GivesOutEveryStateOnceAndInOrder) {
  Board board;
  for (std::uint64_t tick = 1; tick <= 5; ++tick) board.observe(state(tick));
  const auto taken = board.take_states(0);
  ASSERT_EQ(taken.size(), 5U);
  for (std::uint64_t i = 0; i < 5; ++i) EXPECT_EQ(taken[i].tick, i + 1);
  EXPECT_TRUE(board.take_states(0).empty());
  EXPECT_TRUE(board.take_states(7).empty());
}

TEST(Board, KeepsTheNewestStatesWhenNobodyTakesThem) {
  Board board;
  for (std::uint64_t tick = 1; tick <= 100'000; ++tick) board.observe(state(tick));
  EXPECT_EQ(board.devices().at(0).states, 100'000U);
  const std::uint64_t dropped = board.devices().at(0).dropped;
  const auto taken = board.take_states(0);
  EXPECT_LE(taken.size(), Board::kMaxWaiting);
  EXPECT_GE(taken.size(), Board::kMaxWaiting / 2);
  EXPECT_EQ(taken.size() + dropped, 100'000U);
  EXPECT_EQ(taken.back().tick, 100'000U);
  EXPECT_EQ(taken.front().tick, 100'000U - taken.size() + 1);
}

TEST(Board, CountsEachReasonOfEachState) {
  Board board;
  DeviceState limited = state(1);
  limited.reasons = (Reasons(Reason::kEnergy) |= Reason::kSlew).bits();
  board.observe(limited);
  limited.reasons = Reasons(Reason::kSlew).bits() | (1U << 31U);
  board.observe(limited);
  const auto& counts = board.devices().at(0).limited;
  EXPECT_EQ(counts[0], 1U);
  EXPECT_EQ(counts[2], 2U);
  EXPECT_EQ(counts[31], 1U) << "of a newer server";
  EXPECT_EQ(counts[1], 0U);
}

TEST(Board, AddsUpWhatReportsTellOfTheirOwnTime) {
  Board board;
  DeviceReport report;
  report.steps = 1000;
  report.missed = 2;
  report.lateness[3] = 990;
  report.lateness[23] = 10;
  board.observe(report);
  board.observe(report);
  const auto& device = board.devices().at(0);
  EXPECT_EQ(device.steps, 2000U);
  EXPECT_EQ(device.missed, 4U);
  EXPECT_EQ(device.lateness[3], 1980U);
  EXPECT_EQ(device.lateness[23], 20U);
}

TEST(Board, ForgetsAnEngineThatIsToldOfNoMore) {
  Board board;
  board.observe(engine("wall", 100));
  board.observe(engine("wall", 100));
  const auto& engines = board.devices().at(0).engines;
  EXPECT_EQ(engines.at(0).forces, 200U);
  EXPECT_EQ(engines.at(0).late_network, 2U);
  for (int i = 0; i < 3; ++i) board.observe(DeviceReport{});
  EXPECT_EQ(engines.size(), 1U) << "its report may have been lost on the way";
  board.observe(DeviceReport{});
  EXPECT_TRUE(engines.empty());
}

TEST(Board, BeginsAnewWithAnotherEngineOnTheChannel) {
  Board board;
  board.observe(engine("wall", 100));
  board.observe(engine("tissue", 7));
  EXPECT_EQ(board.devices().at(0).engines.at(0).forces, 7U);
}

TEST(Board, IsANewVersionWhenThatWhichThePageShowsHasChanged) {
  Board board;
  std::uint64_t version = board.version();
  const auto changed = [&] { return std::exchange(version, board.version()) != version; };
  board.tell(Contact::kOpen, "connected");
  EXPECT_TRUE(changed());
  board.tell(Contact::kOpen, "connected");
  EXPECT_FALSE(changed());
  DeviceDescription about{.name = "left", .channels = {{.name = "main"}}};
  board.described(about);
  EXPECT_TRUE(changed());
  board.described(about);
  EXPECT_FALSE(changed());
  about.channels[0].holder = "wall";
  board.described(about);
  EXPECT_TRUE(changed());
  about.device = 1;
  board.described(about);
  EXPECT_TRUE(changed());
  board.counted(1);
  EXPECT_TRUE(changed());
  EXPECT_EQ(board.devices().size(), 1U);
  board.counted(1);
  EXPECT_FALSE(changed());
}

TEST(Board, KeepsBothEndsOfACouplingUntilOneIsAlone) {
  Board board;
  const Board::Ports ports = both_ends();
  board.observe(*ports.peer);
  EXPECT_FALSE(board.devices().contains(0) && board.devices().at(0).ports) << "an end without its own is none";
  board.observe(ports.own);
  board.observe(*ports.peer);
  PortFrame own = ports.own;
  own.sequence = 2;
  board.observe(own);
  auto rows = board.take_ports(0);
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_TRUE(rows[0].peer);
  EXPECT_TRUE(rows[1].peer) << "the newest that had come";
  EXPECT_TRUE(board.take_ports(0).empty());
  own.phase = PortPhase::kLost;
  board.observe(own);
  EXPECT_FALSE(board.devices().at(0).ports->peer);
  EXPECT_FALSE(board.take_ports(0).front().peer);
  for (int i = 0; i < 1000; ++i) board.observe(own);
  EXPECT_EQ(board.take_ports(0).size(), Board::kMaxPortsWaiting);
  board.observe(own);
  board.welcomed(Welcome{});
  EXPECT_FALSE(board.devices().at(0).ports) << "perhaps another server";
  EXPECT_TRUE(board.take_ports(0).empty());
}

TEST(PairAccount, IsBothAccountsAndWhatIsUnderWayInTheLeadersJoules) {
  Board::Ports ports = both_ends();
  EXPECT_EQ(role_of(ports), PortRole::kLeader);
  EXPECT_NEAR(pair_account(ports).value(), 0.125 + 0.25 + 0.005, 1e-12);
  ports.own.position_scale = 0.5;  // one joule at the follower is 2/0.5 joules at the leader
  ports.own.force_scale = 2;
  EXPECT_NEAR(pair_account(ports).value(), 0.125 + 4 * 0.25 + 0.005, 1e-12);
  ports.peer->given = 0.01;
  ports.own.taken = 0.004;
  EXPECT_NEAR(pair_account(ports).value(), 0.125 + 4 * (0.25 + 0.006) + 0.005, 1e-12);
  std::swap(ports.own, *ports.peer);
  EXPECT_EQ(role_of(ports), PortRole::kFollower);
  EXPECT_NEAR(pair_account(ports).value(), 0.125 + 4 * (0.25 + 0.006) + 0.005, 1e-12) << "at the follower's server";
}

TEST(PairAccount, IsNotSaidWhereItIsNotKnown) {
  const auto without = [](auto change) {
    Board::Ports ports = both_ends();
    change(ports);
    return pair_account(ports);
  };
  EXPECT_TRUE(without([](Board::Ports&) {}));
  EXPECT_FALSE(without([](Board::Ports& p) { p.peer.reset(); }));
  EXPECT_FALSE(without([](Board::Ports& p) { p.own.position_scale = 0; })) << "the scales are not known";
  EXPECT_FALSE(without([](Board::Ports& p) { p.peer->need = 0; })) << "it has no tank";
  EXPECT_FALSE(without([](Board::Ports& p) { p.own.answers_epoch = 8; })) << "of a peer that has started anew";
  EXPECT_FALSE(without([](Board::Ports& p) { p.peer->answers_epoch = 0; }));
}

}  // namespace
}  // namespace tendon::dash::board_test
