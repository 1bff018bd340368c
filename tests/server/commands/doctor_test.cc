// SPDX-License-Identifier: Apache-2.0
#include "server/commands/doctor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/server/commands/planted_machine.h"

namespace tendon::doctor_test {
namespace {

using namespace std::chrono_literals;
using Machine = testing::PlantedMachine;

constexpr const char* kLimits =
    "Limit                     Soft Limit           Hard Limit           Units     \n"
    "Max locked memory         8388608              8388608              bytes     \n"
    "Max realtime priority     0                    0                              ";

TEST(Doctor, HasAdviceForEverythingThatAnOrdinaryMachineLacks) {
  Machine machine;
  machine.say("proc/sys/kernel/osrelease", "6.1.0-22-amd64");
  machine.say("boot/config-6.1.0-22-amd64", "CONFIG_X=y\nCONFIG_HZ=250\n# CONFIG_HIGH_RES_TIMERS is not set");
  machine.say("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance");
  machine.say("sys/devices/system/cpu/cpu1/cpufreq/scaling_governor", "powersave");
  machine.say("sys/module/usbcore/parameters/autosuspend", "2");
  machine.say("proc/self/limits", kLimits);
  machine.say("sys/devices/system/cpu/isolated", "");
  machine.say("sys/devices/system/cpu/cpu0/cpuidle/state0/latency", "2");
  machine.say("sys/devices/system/cpu/cpu0/cpuidle/state1/latency", "133");
  machine.say("proc/self/timerslack_ns", "50000");
  machine.say("proc/sys/kernel/sched_rt_runtime_us", "100000");
  machine.say("proc/sys/kernel/sched_rt_period_us", "1000000");
  machine.say("proc/cpuinfo", "flags : fpu hypervisor lahf_lm");
  machine.say("sys/devices/system/cpu/online", "0");
  const auto findings = machine.look();
  EXPECT_EQ(findings.at("kernel").found, "6.1.0-22-amd64, without PREEMPT_RT");
  EXPECT_EQ(findings.at("tick").found, "250 Hz, without high-resolution timers");
  EXPECT_EQ(findings.at("governor").found, "performance, powersave");
  EXPECT_EQ(findings.at("usb_autosuspend").found, "after 2 s");
  EXPECT_EQ(findings.at("rtprio_limit").found, "0");
  EXPECT_EQ(findings.at("memlock_limit").found, "8388608 bytes");
  EXPECT_EQ(findings.at("isolated_cpus").found, "none");
  EXPECT_EQ(findings.at("cpu_sleep").found, "up to 133 µs to wake");
  EXPECT_EQ(findings.at("rt_throttling").found, "100000 of each 1000000 µs for real-time threads");
  EXPECT_EQ(findings.at("machine").found, "virtual");
  EXPECT_EQ(findings.at("aes").found, "none: sessions are encrypted with chacha20-poly1305");
  EXPECT_EQ(findings.at("processors").found, "1");
  for (const auto& [key, finding] : findings) {
    EXPECT_EQ(finding.advice.empty(), key == "timer_slack") << key;
  }
}

TEST(Doctor, HasNoneForAMachineThatIsReady) {
  Machine machine;
  machine.say("proc/sys/kernel/osrelease", "6.1.0-22-rt-amd64");
  machine.say("sys/kernel/realtime", "1");
  machine.say("boot/config-6.1.0-22-rt-amd64", "CONFIG_HZ=250\nCONFIG_HIGH_RES_TIMERS=y");
  machine.say("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance");
  machine.say("sys/module/usbcore/parameters/autosuspend", "-1");
  machine.say("proc/self/limits", "Max locked memory  unlimited unlimited bytes\nMax realtime priority 70 70");
  machine.say("sys/devices/system/cpu/isolated", "3");
  machine.say("sys/devices/system/cpu/nohz_full", "3");
  machine.say("sys/devices/system/cpu/cpu0/cpuidle/state1/latency", "133");
  machine.say("dev/cpu_dma_latency", "");
  machine.say("proc/sys/kernel/sched_rt_runtime_us", "950000");
  machine.say("proc/sys/kernel/sched_rt_period_us", "1000000");
  machine.say("proc/cpuinfo", "flags : fpu pclmulqdq aes lahf_lm");
  machine.say("sys/devices/system/cpu/online", "0-2,5");
  const auto findings = machine.look();
  EXPECT_EQ(findings.at("kernel").found, "6.1.0-22-rt-amd64, PREEMPT_RT");
  EXPECT_EQ(findings.at("isolated_cpus").found, "3, without a tick: 3");
  EXPECT_EQ(findings.at("aes").found, "in hardware: sessions are encrypted with aes-256-gcm, chacha20-poly1305");
  EXPECT_EQ(findings.at("processors").found, "4 (`[network] busy = true` uses a whole one)");
  EXPECT_EQ(findings.at("cpu_sleep").found, "up to 133 µs to wake (disabled while the server is running)");
  for (const auto& [key, finding] : findings) EXPECT_EQ(finding.advice, "") << key;
}

TEST(Doctor, OfWhatTheKernelDoesNotSayItClaimsNothing) {
  for (const auto& [key, finding] : Machine().look()) {
    EXPECT_EQ(finding.found, "unknown") << key;
    EXPECT_EQ(finding.advice, "") << key;
  }
}

TEST(Doctor, MeasuresLatenessAgainstTheScheduleNotTheLastWakeUp) {
  // The lateness of wake-up n is n µs, from 0 to 99. There is also a pause in the last one.
  LocalTime now{5s};
  int sleeps = 0;
  LocalTime first_due{};
  const WakeUpClock clock{.now = [&] { return now; },
                          .sleep_until =
                              [&](LocalTime due) {
                                if (sleeps == 0) first_due = due;
                                if (sleeps < 99) {
                                  EXPECT_EQ(due, first_due + sleeps * 1ms);
                                }
                                now = due + (sleeps == 99 ? Duration(40ms) : Duration(sleeps * 1us));
                                ++sleeps;
                              }};
  const auto wakes = measure_wake_ups(clock, 1ms, 100);
  EXPECT_EQ(wakes.count, 100U);
  EXPECT_EQ(wakes.median, 50us);
  EXPECT_EQ(wakes.p99, 40ms);
  EXPECT_EQ(wakes.longest, 40ms);
}

TEST(Doctor, AfterAPauseDoesNotCountThePeriodsThatItMissed) {
  LocalTime now{};
  bool paused = false;
  const WakeUpClock clock{.now = [&] { return now; },
                          .sleep_until =
                              [&](LocalTime due) {
                                now = std::max(now, due) + (paused ? 0ms : 50ms);
                                paused = true;
                              }};
  const auto wakes = measure_wake_ups(clock, 1ms, 10);
  EXPECT_EQ(wakes.longest, 50ms);
  EXPECT_EQ(wakes.median, 0ms);
}

TEST(Doctor, AControlCharacterInAKernelFileIsStillJson) {
  Diagnosis diagnosis;
  diagnosis.findings = {{"kernel", "6.1\x01\t\"rt\"", ""}};
  EXPECT_EQ(nlohmann::json::parse(in_json(diagnosis))["findings"][0]["found"], "6.1\x01\t\"rt\"");
}

TEST(Doctor, JsonAndWordsSayTheSame) {
  Diagnosis diagnosis;
  diagnosis.ordinary = {.count = 1000, .median = 90us, .p99 = 199us, .longest = 6ms};
  diagnosis.realtime = {.count = 1000, .median = 35us, .p99 = 64us, .longest = 3ms};
  diagnosis.refused = {"no \"priority\""};
  diagnosis.findings = {{"kernel", "6.1", "another one"}, {"machine", "not virtual", ""}};
  const auto json = nlohmann::json::parse(in_json(diagnosis));
  EXPECT_EQ(json["wake_ups"]["ordinary"]["p99_us"], 199);
  EXPECT_EQ(json["wake_ups"]["realtime"]["p50_us"], 35);
  EXPECT_EQ(json["wake_ups"]["realtime"]["max_us"], 3000);
  EXPECT_EQ(json["refused"][0], "no \"priority\"");
  EXPECT_EQ(json["findings"][0]["advice"], "another one");
  EXPECT_TRUE(json["findings"][1]["advice"].is_null());
  const std::string words = in_words(diagnosis);
  for (const char* said : {"199 µs", "35 µs", "3000 µs", "no \"priority\"", "6.1", "another one", "not virtual"}) {
    EXPECT_NE(words.find(said), std::string::npos) << said << " in " << words;
  }
}

}  // namespace
}  // namespace tendon::doctor_test
