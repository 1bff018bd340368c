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

/// The whole server on a Falcon, as a user starts it: tendond with deploy/scenes/falcon.toml, a firmware file and a
/// folder of keys; virtual_wall with its key, by UDP; the real libusb. The Falcon is a model, and the kernel's USB is
/// FarFalcon.
class FalconStage {
 public:
  struct Config {
    FakeFalcon::Options falcon = kReady;
    bool record = false;
  };
  /// A Falcon that somebody has used already: with firmware, and homed.
  static constexpr FakeFalcon::Options kReady = {.has_firmware = true, .is_homed = true, .firmware_bytes = 4096};
  static constexpr double kWall = 500;  ///< N/m, at x = 0, in the way of a hand that moves along x

  explicit FalconStage(const Config& config);

  FarFalcon& falcon() noexcept { return falcon_; }
  Server& server() noexcept { return *server_; }
  Client& wall() noexcept { return *wall_; }
  std::filesystem::path recording() const { return folder_.path() / "run.mcap"; }
  const std::filesystem::path& folder() const noexcept { return folder_.path(); }
  /// The scene, as tendond reads it.
  Scene scene() const;

  // The user. By default the hand rests outside the wall and holds no button.
  /// Takes the grip to x, in m from the centre, at `speed`, in m/s; returns when it is there.
  void go_to(double x, double speed = 0.1);
  /// Pulls the grip through as soon as the device asks for it.
  void home() { homes_ = true; }
  /// Lets go of the button and presses it again, outside of the wall, when the lamps are green; returns when there has
  /// been time for the force to be ramped in.
  void arm();
  /// arm(), and into the wall until it pushes the hand back.
  void arm_and_press();

  /// Waits until `what` holds of the model. Throws std::runtime_error after kPatience.
  void wait_until(const std::function<bool(const FakeFalcon&)>& what, const std::string& name);
  /// Waits until the server has sent `count` more commands.
  void wait_for_commands(int count);
  /// The motors push the hand back out of the wall.
  static bool pushed_out(const FakeFalcon& falcon) { return falcon.force().x() < -0.5; }

  /// Waits until no process has the device open any more; what it has seen.
  FarFalcon::Seen wait_for_release();

  /// What came of a SIGKILL of the server, when no process has the device any more.
  struct Killed {
    double pushed_for_ms = 0;          ///< after the signal was sent
    double dead_ms = 0;                ///< … the process was gone, as its parent saw it
    bool pushes = true;                ///< still
    std::vector<std::uint8_t> last{};  ///< what it heard last: the endpoint and the packet
    std::uint64_t by_guardian = 0;     ///< packets that came by the node itself
  };
  Killed kill_server();

  /// Sends `signal` to the server, or to `process`, and waits until the force is zero. Returns the time in ms.
  double released_after(int signal, std::optional<pid_t> process = {});

  /// True when a thread (ours or the server's) waited so long that watchdogs may have tripped.
  bool machine_stood_still();

  /// Forces on a hand deeper in the wall than kDeep.
  static constexpr double kDeep = 0.002;  ///< m
  struct Felt {
    std::uint64_t rounds = 0;   ///< times it was looked at, about once in a millisecond
    std::uint64_t nothing = 0;  ///< … and there was no torque at all
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
  std::optional<LocalTime> used_;  ///< of the Falcon's thread
  mutable std::mutex mutex_;
  Felt felt_;

  std::optional<Server> server_;
  std::optional<Client> wall_;
};

}  // namespace tendon::e2e
