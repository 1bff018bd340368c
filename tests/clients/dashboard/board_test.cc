// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/board.h"

#include <gtest/gtest.h>

#include <string>

#include "core/base/reason.h"

namespace tendon::dash {
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

}  // namespace
}  // namespace tendon::dash
