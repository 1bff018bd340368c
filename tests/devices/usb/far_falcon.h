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

/// A FakeFalcon in this process that can be used by the real libusb of *another* process, for example an unmodified
/// tendond, if that process is started with `environment()`. It runs in real time.
///
///     tendond ── libusb ── far_usbfs (preloaded) ══ cable: a socket ══ FarFalcon, a FakeFalcon and the hand on it
///        └ guardian ──────── the node: a pty, of which FarFalcon has the master end ─┘
///
/// Each time the node is opened, there is a new cable and a new pty. Data written by a guardian arrives after all data
/// that the dead process sent by cable. The Falcon runs in its own thread at the highest real-time priority that is
/// granted.
///
/// Thread-safe.
class FarFalcon {
 public:
  /// Creates its socket in `folder`. Throws std::system_error.
  FarFalcon(const FakeFalcon::Options& options, const std::filesystem::path& folder);
  ~FarFalcon();
  FarFalcon(const FarFalcon&) = delete;
  FarFalcon& operator=(const FarFalcon&) = delete;

  std::vector<std::string> environment() const;

  template <class Act>
  auto with(const Act& act) {
    const std::lock_guard lock(mutex_);
    return act(falcon_);
  }
  /// Called at least once per millisecond in the thread of FarFalcon.
  void set_user(std::function<void(FakeFalcon&, LocalTime)> user);

  void plug();
  void unplug();

  struct Seen {
    bool open = false;                 ///< whether a process has opened the node
    std::uint64_t by_node = 0;         ///< number of packets that a guardian has written to the node
    std::vector<std::uint8_t> last{};  ///< newest packet: endpoint and bytes
    std::optional<LocalTime> let_go;   ///< when the motor torque last became zero
    std::uint64_t pushes_begun = 0;    ///< transitions from zero to nonzero torque
    Duration longest_gap{};            ///< maximum time between two periods
  };
  Seen seen() const;

 private:
  struct Session {
    int cable = -1;   ///< −1 if it was closed by the process that had opened it
    int master = -1;  ///< −1 if it was closed by all processes
    int slave = -1;   ///< used as a gate
    std::unique_ptr<socket_cable::Plug> plug;
    std::uint64_t said = 0;
    std::vector<std::uint8_t> frames{};  ///< unparsed data from the master end
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
