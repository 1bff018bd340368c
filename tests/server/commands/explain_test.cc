// SPDX-License-Identifier: Apache-2.0
#include "server/commands/explain.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/server/scene/scene_text.h"

namespace tendon::explain_test {
namespace {

using namespace std::chrono_literals;

constexpr int kRounds = 4;

/// Returns a clock that is advanced by 1 µs each time it is read.
std::function<Duration()> ticking() {
  return [now = Duration{}]() mutable { return now += 1us; };
}

/// Returns the effects of a device, the tables, and one key.
std::set<std::string> optional_parts() {
  std::set<std::string> keys = {"device.hand",
                                "device.environment",
                                "device.rotation",
                                "device.gripper",
                                "loop.max_speed_m_per_s",
                                "safety",
                                "limiter",
                                "admittance",
                                "field",
                                "teleoperation",
                                "teleoperation.turn",
                                "teleoperation.grip"};
  std::istringstream reference(scene_reference());
  std::string table;
  for (std::string line; std::getline(reference, line);) {
    if (line.starts_with('[')) table = line.substr(1, line.find(']') - 1);
    const bool part = line.starts_with('[') && (table.starts_with("safety.") || table.starts_with("limiter.") ||
                                                table.starts_with("force.") || table.starts_with("device.effects."));
    // The bounds of a handle belong to its motors, so they are not optional.
    const bool bounds = table == "limiter.rotation" || table == "limiter.gripper";
    if (part && !bounds) keys.insert(table);
    const bool key = line.starts_with("  ") && line.find_first_of(" ", 2) == std::string::npos;
    if (table == "device.effects" && key && line != "  mass_kg") keys.insert(table + "." + line.substr(2));
  }
  return keys;
}

TEST(Explain, NamesEveryPartThatASceneMayLeaveOut) {
  std::set<std::string> named;
  for (const auto& part : explain(shipped("demo.toml"), ticking(), kRounds).parts) named.insert(std::string(part.key));
  EXPECT_GT(named.size(), 15U);
  EXPECT_EQ(named, optional_parts());
}

std::set<std::string> listed_in(const char* scene) {
  std::set<std::string> listed;
  for (const auto& part : explain(shipped(scene), ticking(), kRounds).parts) {
    if (part.cost_ns) listed.insert(std::string(part.key));
  }
  return listed;
}

TEST(Explain, OnlyWhatIsListedHasACost) {
  EXPECT_EQ(listed_in("admittance.toml"),
            (std::set<std::string>{"admittance", "device.effects.coulomb_friction_n", "device.effects.force_sensor",
                                   "device.effects.max_force_n", "device.effects.viscous_friction_n_s_per_m",
                                   "device.hand", "limiter"}));
}

TEST(Explain, NamesWhatOfAHandleIsCoupled) {
  const std::set<std::string> listed = listed_in("stylus_leader.toml");
  for (const char* const part :
       {"device.rotation", "device.gripper", "teleoperation", "teleoperation.turn", "teleoperation.grip"}) {
    EXPECT_TRUE(listed.contains(part)) << part;
  }
}

TEST(Explain, SaysHowACouplingIsFeltByEachMethod) {
  for (const CouplingMethod method : kCouplingMethods) {
    const std::string name(to_string(method));
    const bool rate = method == CouplingMethod::kRate;
    std::vector<std::string> settings = {"teleoperation.method=" + name};
    if (rate) {
      for (const char* const key : {"dead_zone_mm=3", "gain_per_s=4", "max_speed_mm_per_s=50"}) {
        settings.push_back(std::string("teleoperation.rate.") + key);
      }
    }
    const Scene scene = shipped("leader.toml", settings);
    const Explanation explanation = explain(scene, ticking(), kRounds);
    EXPECT_TRUE(std::ranges::any_of(explanation.parts, [](const auto& part) {
      return part.key == "teleoperation" && part.cost_ns;
    })) << name;
    const std::string words = in_words(scene, explanation);
    EXPECT_NE(words.find("the leader of a coupling by " + name), std::string::npos) << words;
    EXPECT_EQ(words.find("round trip") != std::string::npos,
              method == CouplingMethod::kWaves || method == CouplingMethod::kPositionPosition ||
                  method == CouplingMethod::kSetPosition || method == CouplingMethod::kPassivity)
        << words;
    EXPECT_EQ(words.find("4 mm/s for each mm of the leader beyond 3 mm, at most 50 mm/s") != std::string::npos, rate)
        << words;
    EXPECT_EQ(words.find("the leader feels a damper of 4 to 8 N·s/m") != std::string::npos,
              method == CouplingMethod::kPassivity)
        << words;
  }
}

TEST(Explain, ACostIsTheDifferenceToTheSceneWithoutThePart) {
  // The clock is advanced by one tick in each round of 200 steps, but not in the first trial without a part (viscous
  // friction). This part therefore seems to cost as much as a whole step.
  const Scene scene = shipped("demo_parts.toml");
  std::size_t looks = 0;
  const std::size_t trials = 3 + 11;  // two trials with all parts, one without the device, and 11 without a part
  Duration now{};
  const auto time = [&] {
    const std::size_t trial = looks++ / 2 % trials;
    if (looks % 2 == 0 && trial != 2 && trial != 3) now += 1us;
    return now;
  };
  const Explanation explanation = explain(scene, time, kRounds);
  EXPECT_NEAR(explanation.step_ns, 5, 1e-9);
  EXPECT_NEAR(explanation.device_ns, 5, 1e-9);
  EXPECT_NEAR(explanation.resolution_ns, 0, 1e-9);
  for (const auto& part : explanation.parts) {
    if (!part.cost_ns) continue;
    EXPECT_NEAR(*part.cost_ns, part.key == "device.effects.viscous_friction_n_s_per_m" ? 5 : 0, 1e-9) << part.key;
  }
}

TEST(Explain, TheDeviceNeverCostsMoreThanTheWholeStep) {
  // The intervals between readings grow, as on a machine that slows down, so later measurements seem to cost more.
  Duration now{};
  Duration between = 1us;
  const auto time = [&] { return now += between += 1us; };
  const Explanation slows = explain(shipped("mechanism.toml"), time, 1);
  EXPECT_LE(slows.device_ns, slows.step_ns);
  EXPECT_GE(slows.device_ns, 0);
}

TEST(Explain, SaysByWhichSuitesSessionsAreSealed) {
  Scene scene = shipped("demo.toml");
  EXPECT_EQ(in_words(scene, {}).find("sealed"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(in_json(scene, {}))["sealed_by"].is_null());
  scene.network.keys = "keys";
  scene.network.suites = {Suite::kNoise};
  EXPECT_NE(in_words(scene, {}).find("for engines, encrypted with chacha20-poly1305, "), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(in_json(scene, {}))["sealed_by"], "chacha20-poly1305");
  scene.network.suites = all_suites();
  const std::string both = nlohmann::json::parse(in_json(scene, {}))["sealed_by"];
  EXPECT_EQ(both, contains(suites_of_this_machine(), Suite::kAesGcm)
                      ? "aes-256-gcm, chacha20-poly1305"
                      : "chacha20-poly1305 (this processor has no AES instructions)");
}

TEST(Explain, SaysThatABusyNetworkThreadTakesAProcessor) {
  Scene scene = shipped("demo.toml");
  const Explanation explanation = explain(scene, ticking(), kRounds);
  EXPECT_EQ(in_words(scene, explanation).find("network.busy"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(in_json(scene, explanation)).at("network_busy"), false);
  scene.network.busy = true;
  EXPECT_NE(in_words(scene, explanation)
                .find("network.busy: the network thread polls instead of sleeping, and always uses a whole processor"),
            std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(in_json(scene, explanation)).at("network_busy"), true);
}

TEST(Explain, SaysHowDatagramsAreMarkedAndWhatWiFiMakesOfIt) {
  Scene scene = shipped("demo.toml");
  EXPECT_EQ(in_words(scene, {}).find("network.dscp"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(in_json(scene, {})).at("network_dscp").is_null());
  scene.network.dscp = Dscp::kExpedited;
  EXPECT_NE(in_words(scene, {}).find("network.dscp: datagrams are marked with EF (46), "), std::string::npos);
  EXPECT_NE(in_words(scene, {}).find("send them like video, unless the access point"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(in_json(scene, {})).at("network_dscp"), 46);
}

TEST(Explain, SaysWhatCountedDevicesTakeTogether) {
  Scene scene = shipped("demo.toml");
  Explanation explanation;
  explanation.step_ns = 500;
  EXPECT_EQ(in_words(scene, explanation).find("device.count"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(in_json(scene, explanation)).at("count"), 1);
  scene.count = 512;
  EXPECT_NE(in_words(scene, explanation)
                .find("device.count: 512 devices, demo-0 to demo-511; their steps take 26 % of a processor"),
            std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(in_json(scene, explanation)).at("count"), 512);
}

TEST(Explain, JsonOfAnyNameIsJson) {
  Scene scene = shipped("demo.toml");
  scene.name = "a \"hand\"\x01\xff";
  EXPECT_EQ(nlohmann::json::parse(in_json(scene, {}))["device"], "a \"hand\"\x01\xEF\xBF\xBD");
}

TEST(Explain, APartThatCostsTooLittleToMeasureHasNoFigure) {
  const Scene scene = shipped("demo.toml");
  Explanation explanation;
  explanation.resolution_ns = 64.2;
  explanation.parts = {
      {"dear", "costs", 70}, {"cheap", "costs hardly anything", 64}, {"saves", "helps", -80}, {"gone", "is off", {}}};
  const std::string words = in_words(scene, explanation);
  EXPECT_NE(words.find("On, with the cost per step:\n"
                       "  dear      70 ns   costs\n"
                       "  saves    -80 ns   helps\n"
                       "On, with a cost below the 65 ns that can be measured on this machine:\n"
                       "  cheap             costs hardly anything\n"
                       "Off in this scene:\n"
                       "  gone              is off\n"),
            std::string::npos)
      << words;
}

TEST(Explain, JsonAndWordsSayTheSame) {
  const Scene scene = shipped("admittance.toml");
  const Explanation explanation = explain(scene, ticking(), kRounds);
  const auto json = nlohmann::json::parse(in_json(scene, explanation));
  const std::string words = in_words(scene, explanation);
  EXPECT_EQ(json["parts"].size(), explanation.parts.size());
  const std::size_t absent = words.find("Off in this scene:");
  for (const auto& part : json["parts"]) {
    const std::size_t place = words.find("  " + part["key"].get<std::string>() + ' ');
    ASSERT_NE(place, std::string::npos) << part;
    EXPECT_EQ(place < absent, part["listed"].get<bool>()) << part;
    EXPECT_EQ(part["cost_ns"].is_null(), !part["listed"].get<bool>());
  }
}

}  // namespace
}  // namespace tendon::explain_test
