// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "tests/devices/usb/far_falcon.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e {

/// Runs the server as in normal use: tendond with deploy/scenes/falcon.toml, a firmware file, a folder of keys, and the
/// real libusb; and virtual_wall with its key, over UDP. Only the Falcon is a model, and FarFalcon replaces the
/// kernel's USB.
class FalconStage {
 public:
  struct Config {
    FakeFalcon::Options falcon = kReady;
    bool record = false;
  };
  static constexpr FakeFalcon::Options kReady = {.has_firmware = true, .is_homed = true, .firmware_bytes = 4096};
  static constexpr double kWall = 500;  ///< N/m, at x = 0, in the path of a hand that moves along x

  explicit FalconStage(const Config& config);

  FarFalcon& falcon() noexcept { return falcon_; }
  Server& server() noexcept { return *server_; }
  Client& wall() noexcept { return *wall_; }
  std::filesystem::path recording() const { return folder_.path() / "run.mcap"; }
  const std::filesystem::path& folder() const noexcept { return folder_.path(); }
  Scene scene() const;

  // Moves the hand to x (m from the center) at `speed` (m/s), and returns when it has arrived. Initially the hand rests
  // outside of the wall and presses no button.
  void go_to(double x, double speed = 0.1);
  void home() { homes_ = true; }
  /// Arms the device with the hand outside of the wall when its lamps are green. Returns after the force ramp.
  void arm();
  void arm_and_press();

  /// Throws std::runtime_error if this takes longer than kPatience.
  void wait_until(const std::function<bool(const FakeFalcon&)>& what, const std::string& name);
  void wait_for_commands(int count);
  static bool pushed_out(const FakeFalcon& falcon) { return falcon.force().x() < -0.5; }

  /// Waits until the device is closed by all processes. Returns the state of the device node at that time.
  FarFalcon::Seen wait_for_release();

  struct Killed {
    double pushed_for_ms = 0;          ///< duration of the force after the signal was sent
    double dead_ms = 0;                ///< time from the signal to the exit of the process
    bool pushes = true;                ///< whether there is a force at the end
    std::vector<std::uint8_t> last{};  ///< the last received endpoint and packet
    std::uint64_t by_guardian = 0;     ///< packets written directly to the device node
  };
  Killed kill_server();

  /// Sends `signal` to the server, or to `process`, and waits until the force is zero. Returns the time in ms.
  double released_after(int signal, std::optional<pid_t> process = {});

  /// Returns whether a thread of the test or the server was delayed long enough to trip watchdogs.
  bool machine_stood_still();

  static constexpr double kDeep = 0.002;  ///< m
  struct Felt {
    std::uint64_t rounds = 0;   ///< samples, about one per millisecond
    std::uint64_t nothing = 0;  ///< samples without any torque
    double share = 0;           ///< sum of (force out of the wall) / (kWall · depth)
  };
  Felt felt() const {
    const std::lock_guard lock(mutex_);
    return felt_;
  }

 private:
  void use(FakeFalcon& falcon, LocalTime now);

  testing::ScratchFolder folder_;
  std::filesystem::path scene_;
  FarFalcon falcon_;

  std::atomic<double> wanted_x_;
  std::atomic<double> x_;
  std::atomic<bool> button_{false};
  std::atomic<bool> homes_{false};
  std::atomic<double> speed_{0.1};
  std::optional<LocalTime> used_;  ///< used by the thread of the Falcon
  mutable std::mutex mutex_;
  Felt felt_;

  std::optional<Server> server_;
  std::optional<Client> wall_;
};

}  // namespace tendon::e2e
