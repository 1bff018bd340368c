// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/metrics.h"

#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>
#include <string>

#include "tests/clients/dashboard/full_board.h"

namespace tendon::dash::metrics_test {
namespace {

bool has_line(const std::string& text, const std::string& line) {
  return ("\n" + text).find("\n" + line + "\n") != std::string::npos;
}

TEST(DashMetrics, ExportWhatIsOnTheBoard) {
  const std::string text = metrics_text(full_board(), {.pages = 2, .requests = 7}, {.to_server = 5, .plain = 3});
  for (
      const char* line : {
          "tendon_up 1",
          R"(tendon_server_info{server="tendond"} 1)",
          R"(tendon_device_position_meters{device="left",axis="y"} -0.5)",
          R"(tendon_device_force_wanted_newtons{device="left"} 5)",
          R"(tendon_device_force_applied_newtons{device="left"} 2)",
          R"(tendon_device_force_permitted_newtons{device="left"} 2.5)",
          R"(tendon_device_energy_joules{device="left"} 0.125)",
          R"(tendon_device_field_generation{device="left"} 3)",
          R"(tendon_device_field_depth_meters{device="left"} 0.0015)",
          R"(tendon_device_mode{device="left",mode="holding"} 1)",
          R"(tendon_device_mode{device="left",mode="active"} 0)",
          R"(tendon_device_states_total{device="left"} 1)",
          R"(tendon_device_states_limited_total{device="left",reason="energy"} 1)",
          R"(tendon_device_states_limited_total{device="left",reason="slew"} 0)",
          R"(tendon_device_safety_state{device="left",state="armed"} 1)",
          R"(tendon_device_fault{device="left"} 0)",
          R"(tendon_device_degraded{device="left"} 1)",
          R"(tendon_device_steps_total{device="left"} 1000)",
          R"(tendon_device_steps_missed_total{device="left"} 3)",
          R"(tendon_engine_delay_seconds{device="left",channel="main",engine="wall",way="round_trip",quantile="0.99"} 0.125)",
          R"(tendon_engine_forces_late_total{device="left",channel="main",engine="wall",cause="network"} 4)",
          R"(tendon_engine_error_newtons{device="left",channel="main",engine="wall",answered_by="near"} 0.25)",
          R"(tendon_engine_datagrams_lost{device="left",channel="main",engine="wall"} 12)",
          R"(tendon_port_phase{device="left",end="own",phase="engaged"} 1)",
          R"(tendon_port_phase{device="left",end="peer",phase="lost"} 0)",
          R"(tendon_port_account_joules{device="left",end="own"} 0.125)",
          R"(tendon_port_account_joules{device="left",end="peer"} 0.25)",
          R"(tendon_port_pair_joules{device="left"} 0.38)",
          R"(tendon_port_round_trip_seconds{device="left",end="peer"} 0.041)",
          "tendon_dash_pages 2",
          "tendon_dash_requests_total 7",
          R"(tendon_bridge_datagrams_total{way="to_server"} 5)",
          R"(tendon_bridge_dropped_total{cause="plain"} 3)",
      }) {
    EXPECT_TRUE(has_line(text, line)) << line << "\nis not in\n" << text;
  }
}

TEST(DashMetrics, CountLatenessInCumulativeBucketsOfSeconds) {
  const std::string text = metrics_text(full_board(), {}, {});
  const std::string bucket = R"(tendon_device_wakeup_lateness_seconds_bucket{device="left",le=")";
  EXPECT_TRUE(has_line(text, bucket + "1e-06\"} 0")) << text;
  EXPECT_TRUE(has_line(text, bucket + "4e-06\"} 0"));
  EXPECT_TRUE(has_line(text, bucket + "8e-06\"} 990"));
  EXPECT_TRUE(has_line(text, bucket + "4.194304\"} 990"));
  EXPECT_TRUE(has_line(text, bucket + "+Inf\"} 997"));
  EXPECT_TRUE(has_line(text, R"(tendon_device_wakeup_lateness_seconds_count{device="left"} 997)"));
}

TEST(DashMetrics, LeaveOutWhatIsNotKnown) {
  Board board;
  const std::string text = metrics_text(board, {}, {});
  EXPECT_TRUE(has_line(text, "tendon_up 0"));
  EXPECT_EQ(text.find("tendon_device_"), std::string::npos);
  EXPECT_EQ(text.find("tendon_engine_"), std::string::npos);
  EXPECT_EQ(text.find("tendon_port_"), std::string::npos);
  EXPECT_EQ(text.find("tendon_server_info"), std::string::npos);
}

TEST(DashMetrics, HaveNamesLabelsAndHelpAsPrometheusWants) {
  const std::string text = metrics_text(full_board(), {}, {});
  static const std::regex sample(
      R"re(([a-z_:][a-z0-9_:]*)(\{([a-z_]+="([^"\\\n]|\\.)*",?)+\})? (Nan|[-+]?Inf|-?[0-9.e+-]+))re");
  static const std::regex type(R"(# TYPE (tendon_[a-z_]+) (counter|gauge|histogram))");
  std::set<std::string> counters;
  std::set<std::string> seen;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_match(line, match, type)) {
      EXPECT_EQ(match.str(2) == "counter", match.str(1).ends_with("_total")) << line;
    } else if (!line.starts_with("# HELP tendon_")) {
      EXPECT_TRUE(std::regex_match(line, match, sample)) << line;
      EXPECT_TRUE(seen.insert(line.substr(0, line.rfind(' '))).second) << "twice: " << line;
    }
  }
  EXPECT_GT(seen.size(), 60U);
}

TEST(DashMetrics, EscapeTheNamesOfStrangers) {
  Board board = full_board();
  PeerReport peer;
  peer.name = "a\"b\\c\nd";
  board.observe(peer);
  const std::string text = metrics_text(board, {}, {});
  EXPECT_NE(text.find(R"(engine="a\"b\\c\nd")"), std::string::npos) << text;
}

}  // namespace
}  // namespace tendon::dash::metrics_test
