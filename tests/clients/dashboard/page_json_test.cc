// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/page_json.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>
#include <vector>

#include "core/base/reason.h"
#include "tests/clients/dashboard/full_board.h"

namespace tendon::dash::page_json_test {
namespace {

using nlohmann::json;
using std::chrono::microseconds;
using std::chrono::milliseconds;

TEST(PageJson, TellsStatesInColumns) {
  DeviceState first;
  first.tick = 7;
  first.sampled = PeerTime(microseconds(1'000'123));
  first.position = Vec3(0.001, -0.5, 0);
  first.force_wanted = Vec3(1, 2, 3);
  first.stiffness_wanted = Mat3{{1, 2, 3}, {4, 5, 6}, {7, 8, 9}};
  first.force_applied = Vec3(0.25, 0, -1);
  first.permitted_force = std::numeric_limits<double>::infinity();
  first.energy = -0.125;
  first.reasons = 5;
  first.force_age = milliseconds(12);
  first.mode = Mode::kActive;
  DeviceState second;
  second.tick = 8;
  const json text = json::parse(states_json(3, std::vector{first, second}));
  EXPECT_EQ(text["type"], "states");
  EXPECT_EQ(text["device"], 3);
  EXPECT_EQ(text["tick"], (json{7, 8}));
  EXPECT_EQ(text["sampled_us"][0], 1'000'123.0);
  EXPECT_FLOAT_EQ(text["position_m"][0][0].get<float>(), 0.001F);
  EXPECT_EQ(text["position_m"][1][0], -0.5);
  EXPECT_EQ(text["wanted_n"][2][0], 3.0);
  EXPECT_TRUE(text["wanted_n"][2][1].is_null()) << "not told";
  EXPECT_EQ(text["stiffness_n_per_m"].size(), 9U);
  EXPECT_EQ(text["stiffness_n_per_m"][1], (json{2.0, nullptr})) << "row by row; the second engine has no model";
  EXPECT_EQ(text["applied_n"][2][0], -1.0);
  EXPECT_TRUE(text["permitted_n"][0].is_null()) << "no bound";
  EXPECT_EQ(text["permitted_n"][1], 0.0);
  EXPECT_EQ(text["energy_j"][0], -0.125);
  EXPECT_EQ(text["reasons"], (json{5, 0}));
  EXPECT_EQ(text["mode"], (json{2, 1}));
  EXPECT_EQ(text["force_age_ms"][0], 12.0);
  for (const auto& [name, column] : text.items()) {
    if (column.is_array()) {
      EXPECT_EQ(column[0].is_array() ? column[0].size() : column.size(), 2U) << name;
    }
  }
}

TEST(PageJson, TellsTheHandleInColumnsWhereAStateHoldsIt) {
  DeviceState turned;
  turned.turning = Turning{.orientation = {.w = 0.5, .x = -0.5, .y = 0.25, .z = 0.125}};
  turned.torque_applied = Vec3(0.1, 0.2, -0.3);
  turned.hand_force = Vec3(1, 2, 3);
  turned.grip = Grip{.opening = 0.25};
  turned.grip_applied = -1.5;
  turned.buttons = 6;
  json text = json::parse(states_json(0, std::vector{turned, DeviceState{}}));
  EXPECT_EQ(text["orientation"], (json{{0.5, nullptr}, {-0.5, nullptr}, {0.25, nullptr}, {0.125, nullptr}}));
  EXPECT_EQ(text["torque_nm"], (json{{0.1, nullptr}, {0.2, nullptr}, {-0.3, nullptr}}));
  EXPECT_EQ(text["hand_force_n"], (json{{1.0, nullptr}, {2.0, nullptr}, {3.0, nullptr}}));
  EXPECT_EQ(text["grip_rad"], (json{0.25, nullptr}));
  EXPECT_EQ(text["grip_n"], (json{-1.5, nullptr}));
  EXPECT_EQ(text["buttons"], (json{6, 0}));
  text = json::parse(states_json(0, std::vector{DeviceState{}}));
  for (const char* name :
       {"orientation", "torque_nm", "hand_force_n", "grip_rad", "grip_n", "buttons", "stiffness_n_per_m"}) {
    EXPECT_FALSE(text.contains(name)) << name << ": a device without it costs nothing";
  }
}

TEST(PageJson, TellsTheFieldInColumnsWhereAStateHoldsOne) {
  DeviceState touching;
  touching.field = FieldState{.generation = 3, .depth = 0.0015, .proxy = Vec3(0.25, -0.5, 0.125)};
  json text = json::parse(states_json(0, std::vector{DeviceState{}, touching}));
  EXPECT_EQ(text["field"], (json{nullptr, 3}));
  EXPECT_EQ(text["field_depth_m"], (json{nullptr, 0.0015}));
  EXPECT_EQ(text["field_proxy_m"], (json{{nullptr, 0.25}, {nullptr, -0.5}, {nullptr, 0.125}}));
  text = json::parse(states_json(0, std::vector{DeviceState{}}));
  for (const char* name : {"field", "field_depth_m", "field_proxy_m"}) EXPECT_FALSE(text.contains(name)) << name;
}

TEST(PageJson, TellsWhatTheHandleIs) {
  Board board;
  board.described(DeviceDescription{.device = 0, .name = "left"});
  EXPECT_TRUE(json::parse(server_json(board, {}))["devices"][0]["handle"].is_null()) << "not told";
  const auto version = board.version();
  board.described(HandleDescription{.device = 0,
                                    .operator_from_device = Quat{.w = 0.5, .x = 0.5, .y = 0.5, .z = 0.5},
                                    .buttons = {"clutch", "dead man"},
                                    .orientation_measured = true,
                                    .max_torque = 0.2,
                                    .gripper_open = 0.5,
                                    .max_gripper_force = 8,
                                    .group = "arms",
                                    .hand = Hand::kLeft});
  EXPECT_GT(board.version(), version) << "or no page is told";
  EXPECT_EQ(json::parse(server_json(board, {}))["devices"][0]["handle"],
            (json{{"operator_from_device", {0.5, 0.5, 0.5, 0.5}},
                  {"buttons", {"clutch", "dead man"}},
                  {"orientation_measured", true},
                  {"max_torque_nm", 0.2},
                  {"gripper_open_rad", 0.5},
                  {"max_gripper_force_n", 8.0},
                  {"group", "arms"},
                  {"hand", "left"}}));
  board.described(HandleDescription{.device = 0});
  const json handle = json::parse(server_json(board, {}))["devices"][0]["handle"];
  EXPECT_TRUE(handle["operator_from_device"].is_null());
  EXPECT_TRUE(handle["gripper_open_rad"].is_null());
  board.welcomed(Welcome{});
  EXPECT_TRUE(json::parse(server_json(board, {}))["devices"][0]["handle"].is_null()) << "perhaps another server";
}

TEST(PageJson, TellsTheServerAndItsDevices) {
  Board board;
  Welcome welcome;
  welcome.server = "tendond \"1\"";
  board.welcomed(welcome);
  board.tell(Contact::kOpen, "connected");
  board.described(
      {.device = 1,
       .name = "right",
       .model = "falcon",
       .workspace = DeviceDescription::Box{Vec3(-1, -2, -3), Vec3(1, 2, 3)},
       .max_force = 8,
       .loop_hz = 1000,
       .channels = {{.name = "main", .rule = ChannelRule::kPriority, .lease = milliseconds(500), .holder = "wall"}}});
  const json text = json::parse(server_json(board, {.server = "127.0.0.1:47100", .recordings = false}));
  EXPECT_EQ(text["contact"], "open");
  EXPECT_EQ(text["version"], "tendond \"1\"");
  EXPECT_EQ(text["recordings"], false);
  const json device = text["devices"][0];
  EXPECT_EQ(device["number"], 1);
  EXPECT_EQ(device["workspace_m"][0][2], -3.0);
  EXPECT_EQ(device["channels"][0],
            (json{{"name", "main"}, {"rule", "priority"}, {"lease_ms", 500.0}, {"holder", "wall"}}));
}

TEST(PageJson, TellsWhetherADeviceMayBeArmedAndWhatBecameOfThePress) {
  Board board;
  board.described({.device = 0, .name = "left", .channels = {{.name = "main"}}});
  board.described({.device = 1, .name = "right", .channels = {{.name = "main"}}});
  json text = json::parse(server_json(board, {}));
  EXPECT_EQ(text["arms"], false);
  EXPECT_TRUE(text["press"].is_null());
  EXPECT_EQ(text["devices"][0]["arming_objection"], kArmingNeeds);
  const auto version = board.version();
  board.tell(Press{.device = 1, .order = Order::kArm, .state = Press::State::kFailed, .words = "Not armed."});
  EXPECT_GT(board.version(), version) << "or no page is told";
  const Abilities may{.server = "", .arms = true, .arming_objection = [](std::uint32_t device) {
                        return device == 1 ? std::string("held") : std::string();
                      }};
  text = json::parse(server_json(board, may));
  EXPECT_EQ(text["arms"], true);
  EXPECT_EQ(text["devices"][0]["arming_objection"], "");
  EXPECT_EQ(text["devices"][1]["arming_objection"], "held");
  EXPECT_EQ(text["press"], (json{{"device", 1}, {"order", "arm"}, {"state", "failed"}, {"words", "Not armed."}}));
}

TEST(PageJson, TellsBothEndsOfACouplingInRows) {
  Board::Ports ports = both_ends();
  ports.at = PeerTime(microseconds(1'000'123));
  ports.own.position = Vec3(0.25, 0, -0.5);
  ports.own.force = Vec3(-2, 0, 0);
  ports.peer->contact_force = Vec3(0, 0.5, 0);
  ports.peer->surface = PortSurface{.stiffness = 500};
  ports.peer->share = 0.75;
  Board::Ports alone;
  alone.own.phase = PortPhase::kAlone;
  const json text = json::parse(ports_json(2, std::vector{ports, alone}));
  EXPECT_EQ(text["type"], "ports");
  EXPECT_EQ(text["device"], 2);
  ASSERT_EQ(text["rows"].size(), 2U);
  const json& row = text["rows"][0];
  EXPECT_EQ(row["at_us"], 1'000'123.0);
  EXPECT_EQ(row["role"], "leader");
  EXPECT_EQ(row["position_scale"], 1.0);
  EXPECT_EQ(row["force_scale"], 1.0);
  EXPECT_EQ(row["pair_j"], 0.38);
  EXPECT_EQ(row["own"], (json{{"phase", "engaged"},
                              {"position_m", {0.25, 0.0, -0.5}},
                              {"force_n", {-2.0, 0.0, 0.0}},
                              {"contact_n", nullptr},
                              {"account_j", 0.125},
                              {"round_trip_ms", 40.0},
                              {"stiffness_n_per_m", nullptr},
                              {"share", nullptr}}));
  EXPECT_EQ(row["peer"]["contact_n"], (json{0.0, 0.5, 0.0}));
  EXPECT_EQ(row["peer"]["stiffness_n_per_m"], 500.0);
  EXPECT_EQ(row["peer"]["share"], 0.75);
  const json& lone = text["rows"][1];
  for (const char* unknown : {"role", "peer", "position_scale", "force_scale", "pair_j"}) {
    EXPECT_TRUE(lone[unknown].is_null()) << unknown;
  }
  EXPECT_EQ(lone["own"]["phase"], "alone");
  EXPECT_TRUE(lone["own"]["account_j"].is_null()) << "it has no tank";
  EXPECT_TRUE(lone["own"]["round_trip_ms"].is_null());
}

TEST(PageJson, TellsHowTheLoopAndTheEnginesDo) {
  Board board;
  board.described({.device = 0, .name = "left", .channels = {{.name = "main"}, {.name = "tissue"}}});
  json text = json::parse(reports_json(0, board));
  EXPECT_TRUE(text["loop"].is_null());
  EXPECT_TRUE(text["engines"].empty());
  DeviceReport report;
  report.safety = Safety::kFault;
  report.fault = "too fast";
  report.degraded = "";
  report.lateness[4] = 9;
  board.observe(report);
  board.observe(report);
  PeerReport peer;
  peer.channel = 1;
  peer.name = "liver";
  peer.link.round_trip = Delays{milliseconds(40), milliseconds(130)};
  peer.link.lost = 12;
  board.observe(peer);
  text = json::parse(reports_json(0, board));
  EXPECT_EQ(text["loop"]["safety"], "fault");
  EXPECT_EQ(text["loop"]["fault"], "too fast");
  EXPECT_EQ(text["loop"]["lateness_us_log2"][4], 9);
  EXPECT_EQ(text["loop"]["lateness_us_log2_total"][4], 18);
  EXPECT_EQ(text["loop"]["lateness_us_log2"].size(), limits::kLatenessBuckets);
  ASSERT_EQ(text["engines"].size(), 1U);
  EXPECT_EQ(text["engines"][0]["channel"], "tissue");
  EXPECT_EQ(text["engines"][0]["round_trip_ms"], (json{{"median", 40.0}, {"p99", 130.0}}));
  EXPECT_TRUE(text["engines"][0]["to_server_ms"].is_null());
  EXPECT_EQ(text["engines"][0]["lost"], 12);
  EXPECT_TRUE(text["engines"][0]["error_n"].is_null()) << "it does not say";
  EXPECT_EQ(text["engines"][0]["way"], "");
  peer.error = 0.25;
  peer.way = "near";
  board.observe(peer);
  text = json::parse(reports_json(0, board));
  EXPECT_EQ(text["engines"][0]["error_n"], 0.25);
  EXPECT_EQ(text["engines"][0]["way"], "near");
  EXPECT_TRUE(json::parse(reports_json(9, board))["loop"].is_null()) << "no such device";
}

TEST(PageJson, NamesEveryReasonAsTheCoreDoes) {
  for (std::size_t bit = 0; bit < 32; ++bit) {
    std::string name = to_string(Reasons::from_bits(1U << bit));
    std::ranges::replace_if(
        name, [](char c) { return c == ' ' || c == '-'; }, '_');
    EXPECT_EQ(reason_name(bit), name.empty() ? "bit_" + std::to_string(bit) : name);
  }
}

TEST(PageJson, WritesSevenDigitsForPlots) {
  DeviceState state;
  state.position = Vec3(0.1, 1.0 / 3, 0);
  const std::string text = states_json(0, std::vector{state});
  EXPECT_NE(text.find("\"position_m\":[[0.1],[0.33333334],[0.0]]"), std::string::npos) << text;
}

TEST(PageJson, ReplacesBytesThatAreNoUtf8) {
  Board board;
  for (const std::string bad : {"\x80", "\xC0\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xE2\x82"}) {
    board.tell(Contact::kLost, "a" + bad + "\n\"b");
    const auto words = json::parse(server_json(board, {}))["words"].get<std::string>();
    EXPECT_TRUE(words.starts_with("a\xEF\xBF\xBD") && words.ends_with("\n\"b")) << words;
  }
}

TEST(PageJson, ListsRecordings) {
  const std::vector<Recordings::Entry> entries = {{"a \"b\".mcap", 5'000'000'000, 1.5}};
  EXPECT_EQ(json::parse(recordings_json(entries)),
            (json::array({{{"name", "a \"b\".mcap"}, {"size_bytes", 5'000'000'000}, {"modified_unix_s", 1.5}}})));
}

}  // namespace
}  // namespace tendon::dash::page_json_test
