// SPDX-License-Identifier: Apache-2.0
// Runs tendond with a model of a Falcon through the real libusb, and a remote wall in a separate process. The results
// are checked with the motor commands that arrive at the end of the cable.
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "devices/falcon/packet.h"
#include "tests/e2e/stage/falcon_stage.h"
#include "tests/e2e/stage/threads.h"

namespace tendon::e2e::falcon_server_test {
namespace {

constexpr std::uint8_t kOut = 0x02;

/// The watchdogs of the scene assume that the machine does not pause. If a claim fails after a pause, it is therefore
/// repeated, but at most twice.
template <class Claim>
void on_a_stage(const FalconStage::Config& config, const Claim& claim) {
  for (int left = 2;; --left) {
    FalconStage stage(config);
    try {
      claim(stage);
      return;
    } catch (const std::runtime_error& vain) {
      if (left == 0 || !stage.machine_stood_still()) throw;
      std::cout << "the machine stood still, once more: " << vain.what() << '\n';
    }
  }
}

/// Faults are only accepted after a pause of the machine.
void expect_no_fault(FalconStage& stage, const std::string& end) {
  const auto faults = count_in(end.substr(end.find("\"safety\"")), "faults");
  if (faults + count_in(end, "fault") == 0) return;
  throw std::runtime_error("a fault: " + end + "\n" + stage.server().process().err());
}

std::vector<std::uint8_t> last_packet() {
  std::vector<std::uint8_t> packet = {kOut};
  std::ranges::copy(falcon::encode(falcon::kLastCommand), std::back_inserter(packet));
  return packet;
}

bool no_torque(const std::vector<std::uint8_t>& packet) {
  return packet.size() == 17 && std::all_of(packet.begin() + 2, packet.begin() + 14, [](auto c) { return c == 'A'; });
}

TEST(FalconServer, FromThePlugToAWallThatIsFeltAndPassive) {
  constexpr FakeFalcon::Options kJustPluggedIn = {.has_firmware = false, .firmware_bytes = 4096};
  on_a_stage({.falcon = kJustPluggedIn, .record = true}, [](FalconStage& stage) {
    stage.server().process().wait_for_line("the device must be homed");
    EXPECT_EQ(stage.falcon().seen().pushes_begun, 0U);
    stage.home();
    stage.wait_until([](const FakeFalcon& falcon) { return falcon.lamps() == falcon::kGreen; }, "green lamps");
    stage.wait_for_commands(100);
    EXPECT_EQ(stage.falcon().seen().pushes_begun, 0U);
    stage.arm_and_press();
    for (int i = 0; i < 3; ++i) {
      stage.go_to(0.001);
      stage.go_to(0.004);
    }
    const std::string end = stage.server().stop();
    expect_no_fault(stage, end);
    EXPECT_NE(end.find(R"("state":"armed")"), std::string::npos) << end;
    EXPECT_EQ(count_in(end, "welcomed"), 1U);
    EXPECT_EQ(count_in(end, "hellos_plain"), 0U);
    EXPECT_EQ(number_in(end, "force_n"), 0);
    EXPECT_GT(stage.felt().rounds, stage.felt().nothing);

    const Recording recording = read_recording(stage.recording());
    EXPECT_EQ(recording.steps.size(), count_in(end, "steps"));
    expect_passive(recording, stage.scene());
    std::size_t pushed = 0;
    for (const StepRecord& step : recording.steps) {
      if (step.reasons.has(Reason::kUnseen)) continue;
      if (step.applied.x() < -0.5) ++pushed;
      EXPECT_LT(step.applied.x(), 0.05) << "at tick " << step.tick << ": out of the wall only";
    }
    EXPECT_GT(pushed, 0U);
  });
}

TEST(FalconServer, KilledInMidForceItLeavesNoTorque) {
  std::vector<double> ms;
  for (int i = 0; i < 3; ++i) {
    on_a_stage({}, [&ms](FalconStage& stage) {
      stage.arm_and_press();
      const FalconStage::Killed killed = stage.kill_server();
      EXPECT_FALSE(killed.pushes);
      EXPECT_EQ(killed.last, last_packet());
      EXPECT_GE(killed.by_guardian, 2U) << "when its parent was dead, and when all were";
      ms.push_back(killed.pushed_for_ms);
    });
  }
  std::ranges::sort(ms);
  std::cout << "SIGKILL of tendond to no torque at the Falcon: median " << ms[1] << " ms, n = 3\n";
}

TEST(FalconServer, StoppedInMidForceItLetsGoAndPushesAgainOnlyAfterArming) {
  for (const int signal : {SIGSTOP, SIGTSTP}) {
    on_a_stage({}, [signal](FalconStage& stage) {
      stage.arm_and_press();
      const double ms = stage.released_after(signal);
      std::cout << (signal == SIGSTOP ? "SIGSTOP" : "SIGTSTP") << " of tendond to no torque at the Falcon: " << ms
                << " ms\n";
      while (state_of(stage.server().process().pid()) != 'T') std::this_thread::sleep_for(std::chrono::milliseconds(1));
      stage.go_to(0.004);
      EXPECT_FALSE(stage.falcon().with([](const FakeFalcon& falcon) { return falcon.pushes(); }))
          << "while it is stopped";
      const auto pushes_begun = stage.falcon().seen().pushes_begun;
      stage.server().process().signal(SIGCONT);
      stage.server().process().wait_for_line("fault of the safety layer: ");
      stage.wait_for_commands(300);
      EXPECT_EQ(stage.falcon().seen().pushes_begun, pushes_begun) << "before it was armed\n"
                                                                  << stage.server().process().err();
      stage.arm();
      // This can require several presses, because the ledger assumes that the force was held during the pause.
      const auto pushed = [&stage] {
        stage.go_to(-0.015);
        stage.go_to(0.004);
        stage.wait_for_commands(50);
        return stage.falcon().with(FalconStage::pushed_out);
      };
      int presses = 1;
      while (!pushed() && presses < 20) ++presses;
      EXPECT_LT(presses, 20);
      EXPECT_EQ(number_in(stage.server().stop(), "force_n"), 0);
    });
  }
}

pid_t guardian_of(pid_t server) {
  for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(server) + "/task")) {
    std::ifstream children(thread.path() / "children");
    if (pid_t child = 0; children >> child) return child;
  }
  throw std::runtime_error("the server has no guardian");
}

TEST(FalconServer, WithoutItsGuardianItLetsGoAndIsNotArmed) {
  for (const int signal : {SIGKILL, SIGSTOP}) {
    on_a_stage({}, [signal](FalconStage& stage) {
      stage.arm_and_press();
      const pid_t guardian = guardian_of(stage.server().process().pid());
      const double ms = stage.released_after(signal, guardian);
      std::cout << (signal == SIGSTOP ? "SIGSTOP" : "SIGKILL") << " of the guardian to no torque at the Falcon: " << ms
                << " ms\n";
      stage.server().process().wait_for_line("fault of the safety layer: the guardian process was killed or stopped");
      const auto pushes_begun = stage.falcon().seen().pushes_begun;
      stage.go_to(-0.015);
      stage.go_to(0.004);
      stage.wait_for_commands(300);
      EXPECT_EQ(stage.falcon().seen().pushes_begun, pushes_begun);
      if (signal == SIGSTOP) ::kill(guardian, SIGCONT);
      EXPECT_EQ(number_in(stage.server().stop(), "force_n"), 0);
    });
  }
}

TEST(FalconServer, IgnoresTheSignalsOfATerminalThatWantsNoOutput) {
  on_a_stage({}, [](FalconStage& stage) {
    stage.arm_and_press();
    for (const int signal : {SIGTTOU, SIGTTIN}) stage.server().process().signal(signal);
    stage.wait_for_commands(300);
    EXPECT_TRUE(stage.falcon().with(FalconStage::pushed_out));
    expect_no_fault(stage, stage.server().stop());
  });
}

TEST(FalconServer, EndedBySigtermInMidForceItsLastWordIsNoTorque) {
  on_a_stage({}, [](FalconStage& stage) {
    stage.arm_and_press();
    const std::set<std::string> page = threads_of_the_page();
    const std::set<std::string> threads = threads_of(stage.server().process().pid());
    for (const std::string& thread : threads) EXPECT_TRUE(page.contains(general_name(thread))) << thread;
    for (const char* thread : {"usb-0", "guardian-parent"}) EXPECT_EQ(threads.count(thread), 1U) << thread;
    const std::string end = stage.server().stop(SIGTERM);
    EXPECT_EQ(number_in(end, "force_n"), 0) << end;
    const FarFalcon::Seen seen = stage.wait_for_release();
    EXPECT_TRUE(no_torque(seen.last));
    EXPECT_FALSE(stage.falcon().with([](const FakeFalcon& falcon) { return falcon.pushes(); }));
  });
}

TEST(FalconServer, UnpluggedInMidForceItPushesAgainOnlyAfterHomingAndArming) {
  on_a_stage({}, [](FalconStage& stage) {
    Process& server = stage.server().process();
    stage.arm_and_press();
    stage.falcon().unplug();
    server.wait_for_line("the device is not plugged in");
    const std::string flight = server.wait_for_line("the steps before the fault are saved in ");
    EXPECT_NE(server.err().find("fault of the safety layer: the device was unplugged"), std::string::npos)
        << server.err();
    const auto pushes_begun = stage.falcon().seen().pushes_begun;
    stage.falcon().plug();  // loses firmware and origin while the hand is in the wall and the button is pressed
    server.wait_for_line("the device must be homed");
    stage.wait_for_commands(100);
    EXPECT_EQ(stage.falcon().seen().pushes_begun, pushes_begun) << "before it was homed";
    stage.home();
    stage.wait_until([](const FakeFalcon& falcon) { return falcon.lamps() == falcon::kGreen; }, "green lamps");
    stage.wait_for_commands(300);
    EXPECT_EQ(stage.falcon().seen().pushes_begun, pushes_begun) << "before it was armed";
    stage.arm_and_press();
    const std::string end = stage.server().stop();
    EXPECT_NE(end.find(R"("state":"armed")"), std::string::npos) << end;

    const Recording recording = read_recording(stage.folder() / flight.substr(flight.rfind(' ') + 1));
    ASSERT_GT(recording.steps.size(), 1U);
    EXPECT_EQ(recording.steps.back().applied, Vec3(0, 0, 0));
  });
}

TEST(FalconServer, WhatItsDriverCountsIsInTheLogAndInTheLastReport) {
  on_a_stage({}, [](FalconStage& stage) {
    stage.wait_for_commands(100);
    stage.falcon().with([](FakeFalcon& falcon) { falcon.set_fault(FakeFalcon::Fault::kSilent); });
    stage.server().process().wait_for_line("silences: ");
    const std::string end = stage.server().stop();
    const std::string counts = end.substr(end.find("\"counts\""));
    EXPECT_GE(count_in(counts, "silences"), 1U) << end;
    EXPECT_GE(count_in(counts, "answers"), 100U) << end;
  });
}

}  // namespace
}  // namespace tendon::e2e::falcon_server_test
