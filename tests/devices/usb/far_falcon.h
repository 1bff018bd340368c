// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "core/base/time.h"
#include "tests/devices/falcon/fake_falcon.h"
#include "tests/devices/falcon/socket_cable.h"

namespace tendon {

/// A FakeFalcon in this process and in real time, that the real libusb of *another* process finds, opens and speaks to
/// when that process has been started with `environment()`: tendond, not one byte of it changed.
///
///     tendond ── libusb ── far_usbfs (preloaded) ══ cable: a socket ══ FarFalcon, a FakeFalcon and the hand on it
///        └ guardian ──────── the node: a pty, of which FarFalcon has the master end ─┘
///
/// For each opening of the node there is a new cable and a new pty. What a guardian writes to the node that it has been
/// given comes out at the master end, after all that the dead process has sent by cable.
///
/// A thread of its own with the highest real-time priority that the system grants: it is hardware.
///
/// Thread-safe.
class FarFalcon {
 public:
  /// `folder` is where its socket will be. Throws std::system_error.
  FarFalcon(const FakeFalcon::Options& options, const std::filesystem::path& folder);
  ~FarFalcon();
  FarFalcon(const FarFalcon&) = delete;
  FarFalcon& operator=(const FarFalcon&) = delete;

  /// "NAME=value", for the process that is to find it.
  std::vector<std::string> environment() const;

  /// Calls `act(falcon)` while nobody else touches it.
  template <class Act>
  auto with(const Act& act) {
    const std::lock_guard lock(mutex_);
    return act(falcon_);
  }
  /// What the user does with the device: called at least once in a millisecond, in its thread.
  void set_user(std::function<void(FakeFalcon&, LocalTime)> user);

  void plug();
  void unplug();

  struct Seen {
    bool open = false;                 ///< some process has the node open
    std::uint64_t by_node = 0;         ///< packets that came through the node itself: a guardian's
    std::vector<std::uint8_t> last{};  ///< the newest packet: the endpoint and its bytes
    std::optional<LocalTime> let_go;   ///< when the motors last went from some torque to none
    std::uint64_t pushes_begun = 0;    ///< times when they went from none to some
    Duration longest_gap{};            ///< between two rounds of its thread: how long it stood still
  };
  Seen seen() const;

 private:
  /// An open node.
  struct Session {
    int cable = -1;   ///< −1: the process that opened it has closed it, or is dead
    int master = -1;  ///< −1: nobody has it any more
    int slave = -1;   ///< for its gate
    std::unique_ptr<socket_cable::Plug> plug;
    std::uint64_t said = 0;
    std::vector<std::uint8_t> frames{};  ///< from the master end, not taken apart yet
  };

  void run();
  void wait(LocalTime now);
  void turn(LocalTime now);
  void take_in_new();
  void serve(Session& session, LocalTime now);
  void hear_node(Session& session, LocalTime now);
  static void hang_up(Session& session);

  mutable std::mutex mutex_;
  FakeFalcon falcon_;
  std::function<void(FakeFalcon&, LocalTime)> user_;
  std::vector<Session> sessions_;
  Seen seen_;
  std::optional<LocalTime> turned_;

  std::filesystem::path socket_;
  int listener_ = -1;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace tendon
