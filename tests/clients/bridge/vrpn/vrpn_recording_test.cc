// SPDX-License-Identifier: Apache-2.0
// Kills or stops a VRPN program while it pushes, and checks the recording of the device.
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <csignal>
#include <string>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::vrpn_recording_test {
namespace {

using testing::ScratchFolder;

constexpr const char* kStillHand = R"([device]
kind = "simulated"
profile = "falcon"

[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05

[device.hand.motion]
kind = "sine"
amplitude_mm = 0
frequency_hz = 1

[limiter]
kind = "none"
)";
constexpr double kPush = -2;  // N, along x: `vrpn_client.py … press`
/// N/ms. A fade of 50 ms changes a force of 2 N by 0.04 N in the first millisecond.
constexpr double kFastest = 0.05;

std::vector<StepRecord> after_the_last_fresh_one(const Recording& recording) {
  const auto last = std::find_if(recording.steps.rbegin(), recording.steps.rend(), [](const StepRecord& step) {
    return step.mode == Mode::kActive && step.applied.x() < 0.99 * kPush;
  });
  return {last.base(), recording.steps.end()};
}

void expect_that_it_fades(int signal) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), write(folder.path() / "scene.toml", kStillHand), {"--record", file.string()});
  Service bridged("tendon-bridge", {"vrpn", "--server", server.address()}, folder.path(), "listening", "address");
  Process old(TENDON_PYTHON, {TENDON_VRPN_CLIENT, bridged.address(), "press"}, folder.path());
  Process echo(program("echo_motion"), {"--server", server.address(), "--json"}, folder.path());
  watch_force(echo, [](double force) { return force < 0.99 * kPush; });
  ::poll(nullptr, 0, 300);
  old.signal(signal);
  watch_force(echo, [](double force) { return force == 0; });
  if (signal == SIGSTOP) old.signal(SIGKILL);
  bridged.stop();
  server.stop();

  const std::vector<StepRecord> steps = after_the_last_fresh_one(read_recording(file));
  ASSERT_FALSE(steps.empty());
  double last = kPush;
  Duration faded{};
  LocalTime before = steps.front().hand.at;
  for (const StepRecord& step : steps) {
    const double passed = std::max(1.0, std::chrono::duration<double, std::milli>(step.hand.at - before).count());
    EXPECT_LT(std::abs(step.applied.x() - last), kFastest * passed) << "tick " << step.tick;
    last = step.applied.x();
    before = step.hand.at;
    if (last != 0) faded = step.hand.at - steps.front().hand.at;
  }
  EXPECT_EQ(last, 0);
  EXPECT_LE(faded, std::chrono::milliseconds(300)) << "from the last force that was valid on";
  EXPECT_TRUE(std::ranges::any_of(steps, [](const StepRecord& step) { return step.mode == Mode::kDecaying; }));
}

TEST(VrpnRecording, AProgramThatIsKilledWithForceOnFadesWithoutAJump) { expect_that_it_fades(SIGKILL); }

TEST(VrpnRecording, AProgramThatIsFrozenWithForceOnFadesWithoutAJump) { expect_that_it_fades(SIGSTOP); }

}  // namespace
}  // namespace tendon::e2e::vrpn_recording_test
