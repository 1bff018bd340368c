// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace tendon {

/// Wakes the one thread that waits for it, from another thread or from a signal handler: the haptic
/// thread rings it after each step, the network thread waits for it together with its socket.
/// Unanswered rings count as one. (An eventfd.)
class Doorbell {
 public:
  /// Throws std::system_error when the process has no file descriptor left.
  Doorbell();
  ~Doorbell();
  Doorbell(const Doorbell&) = delete;
  Doorbell& operator=(const Doorbell&) = delete;

  /// Thread-safe: yes. Async-signal-safe: yes (errno is kept). Realtime-safe: yes: one system call
  /// that never waits, no heap, no lock of ours.
  void ring() noexcept;

  /// Whether it has rung since the last answer: for a thread that does not sleep. No system call.
  bool rung() const noexcept { return rung_.load(std::memory_order_acquire); }

  /// Answers the rings so far. A caller that waits on fd() itself calls this; UdpLink::wait does so by itself.
  void answer() noexcept;

  /// Readable while a ring is unanswered: for poll() and UdpLink::wait.
  int fd() const noexcept { return fd_; }

 private:
  static_assert(std::atomic<bool>::is_always_lock_free);  // signal handlers ring, too
  int fd_;
  std::atomic<bool> rung_{false};
};

}  // namespace tendon
