// SPDX-License-Identifier: Apache-2.0
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "clients/dashboard/metrics.h"
#include "recording.pb.h"
#include "tests/clients/dashboard/full_board.h"

// The files in deploy/monitoring must only use metrics, labels and fields that exist.

namespace tendon::dash::monitoring_test {
namespace {

std::string read(const std::string& name) {
  std::ifstream file(std::filesystem::path(TENDON_MONITORING) / name);
  EXPECT_TRUE(file) << name;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::map<std::string, std::set<std::string>> exported() {
  const std::string text = metrics_text(full_board(), {}, {});
  static const std::regex sample(R"(^(tendon_[a-z_]+)(\{[^\n]*\})? )", std::regex::multiline);
  static const std::regex label(R"re(([a-z_]+)=")re");
  std::map<std::string, std::set<std::string>> names;
  for (auto match = std::sregex_iterator(text.begin(), text.end(), sample); match != std::sregex_iterator(); ++match) {
    auto& labels = names[match->str(1)];
    labels.insert("instance");  // added by Prometheus
    const std::string all = match->str(2);
    for (auto one = std::sregex_iterator(all.begin(), all.end(), label); one != std::sregex_iterator(); ++one)
      labels.insert(one->str(1));
  }
  return names;
}

/// The metrics that are used in PromQL, and the labels that are used to select or group them.
std::set<std::string> expect_exported(const std::string& expression) {
  static const std::map<std::string, std::set<std::string>> known = exported();
  static const std::regex metric(R"((tendon_[a-z_]+)(\{([^}]*)\})?)");
  static const std::regex choice(R"re(([a-z_]+)(=|!=|=~|!~)")re");
  static const std::regex group(R"(\b(?:by|on|without|ignoring)\s*\(([a-z_, ]*)\))");
  std::set<std::string> used;
  std::set<std::string> labels;
  for (auto match = std::sregex_iterator(expression.begin(), expression.end(), metric); match != std::sregex_iterator();
       ++match) {
    const std::string name = match->str(1);
    used.insert(name);
    if (name == "tendon_expected_servers") continue;  // defined by the site's inventory
    const auto found = known.find(name);
    if (found == known.end()) {
      ADD_FAILURE() << name << " is not exported: " << expression;
      continue;
    }
    labels.insert(found->second.begin(), found->second.end());
    const std::string choices = match->str(3);
    for (auto one = std::sregex_iterator(choices.begin(), choices.end(), choice); one != std::sregex_iterator(); ++one)
      EXPECT_TRUE(found->second.contains(one->str(1))) << name << " has no label " << one->str(1);
  }
  // Prometheus sets `up` for each target.
  if (expression.starts_with("up{job=\"tendon\"}")) used.insert("up");
  EXPECT_FALSE(used.empty()) << "names no metric: " << expression;
  for (auto match = std::sregex_iterator(expression.begin(), expression.end(), group); match != std::sregex_iterator();
       ++match) {
    std::istringstream names(std::regex_replace(match->str(1), std::regex(","), " "));
    for (std::string name; names >> name;)
      EXPECT_TRUE(labels.contains(name)) << "no label " << name << ": " << expression;
  }
  return used;
}

TEST(Monitoring, TheGrafanaDashboardShowsWhatIsExported) {
  const auto dashboard = nlohmann::json::parse(read("grafana.json"));
  std::set<std::string> used;
  std::set<int> ids;
  for (const auto& panel : dashboard.at("panels")) {
    EXPECT_TRUE(ids.insert(panel.at("id").get<int>()).second) << "two panels of one id";
    EXPECT_EQ(panel.at("datasource").at("uid"), "${source}");
    const auto& place = panel.at("gridPos");
    EXPECT_LE(place.at("x").get<int>() + place.at("w").get<int>(), 24);
    ASSERT_FALSE(panel.at("targets").empty());
    for (const auto& target : panel.at("targets")) used.merge(expect_exported(target.at("expr").get<std::string>()));
  }
  for (const auto& variable : dashboard.at("templating").at("list")) {
    if (variable.at("type") == "query") expect_exported(variable.at("query").get<std::string>());
  }
  EXPECT_GT(used.size(), 15U);
}

TEST(Monitoring, TheAlertsAskForWhatIsExported) {
  std::istringstream lines(read("alerts.yml"));
  static const std::regex rule(R"(^      - alert: (Tendon[A-Za-z]+)$)");
  static const std::regex expression(R"(^        expr: (.+)$)");
  static const std::regex severity(R"(^        labels: \{ severity: (critical|warning) \}$)");
  std::set<std::string> alerts;
  std::size_t expressions = 0;
  std::size_t severities = 0;
  std::size_t summaries = 0;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_EQ(line.find('\t'), std::string::npos) << "YAML has no tabs";
    std::smatch match;
    if (std::regex_match(line, match, rule)) {
      EXPECT_TRUE(alerts.insert(match.str(1)).second) << line;
    }
    if (std::regex_match(line, match, expression)) {
      ++expressions;
      expect_exported(match.str(1));
    }
    severities += std::regex_match(line, severity) ? 1U : 0U;
    summaries += line.starts_with("          summary: \"") ? 1U : 0U;
  }
  EXPECT_GE(alerts.size(), 8U);
  EXPECT_EQ(expressions, alerts.size());
  EXPECT_EQ(severities, alerts.size());
  EXPECT_EQ(summaries, alerts.size());
}

TEST(Monitoring, PrometheusLoadsTheseAlertsAndLooksAtThemAsOftenAsItScrapes) {
  const std::string text = read("prometheus.yml");
  EXPECT_NE(text.find("\n  scrape_interval: 5s\n"), std::string::npos);
  EXPECT_NE(text.find("\n  evaluation_interval: 5s"), std::string::npos);
  EXPECT_NE(text.find("\n  - alerts.yml\n"), std::string::npos);
  EXPECT_NE(text.find("127.0.0.1:8080"), std::string::npos);
}

std::set<std::string> panels_of(const nlohmann::json& part) {
  if (part.is_string()) return {part.get<std::string>()};
  std::set<std::string> all = panels_of(part.at("first"));
  all.merge(panels_of(part.at("second")));
  return all;
}

/// A path such as "/haptic/step.position_m.x" names a number, bool or enum of a step.
bool is_plotted_field(const std::string& path) {
  constexpr std::string_view kTopic = "/haptic/step.";
  if (!path.starts_with(kTopic)) return false;
  const google::protobuf::Descriptor* message = recording::v1::Step::descriptor();
  std::istringstream names(path.substr(kTopic.size()));
  const google::protobuf::FieldDescriptor* field = nullptr;
  for (std::string name; std::getline(names, name, '.'); message = field->message_type()) {
    field = message == nullptr ? nullptr : message->FindFieldByName(name);
    if (field == nullptr || field->is_repeated()) return false;
  }
  return message == nullptr;
}

TEST(Monitoring, TheFoxgloveLayoutPlotsStepsLiveAndRecorded) {
  const auto file = nlohmann::json::parse(read("foxglove-layout.json"));
  std::set<std::string> configured;
  std::size_t paths = 0;
  for (const auto& [name, panel] : file.at("configById").items()) {
    configured.insert(name);
    if (name.starts_with("3D!")) {
      EXPECT_EQ(panel.at("followTf"), "world");
      for (const auto& [topic, shown] : panel.at("topics").items()) EXPECT_TRUE(topic.ends_with("/scene")) << topic;
      continue;
    }
    for (const auto& path : panel.at("paths")) {
      EXPECT_TRUE(is_plotted_field(path.at("value").get<std::string>())) << path;
      ++paths;
    }
  }
  EXPECT_EQ(panels_of(file.at("layout")), configured);
  EXPECT_GT(paths, 10U);
  EXPECT_FALSE(is_plotted_field("/haptic/step.position_m"));
  EXPECT_FALSE(is_plotted_field("/haptic/step.position"));
}

}  // namespace
}  // namespace tendon::dash::monitoring_test
