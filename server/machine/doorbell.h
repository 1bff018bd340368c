// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace tendon {

/// Wakes a waiting thread from another thread or from a signal handler, using an eventfd. Multiple rings are counted as
/// one until `answer` is called.
class Doorbell {
 public:
  /// Throws std::system_error if there are no file descriptors left.
  Doorbell();
  ~Doorbell();
  Doorbell(const Doorbell&) = delete;
  Doorbell& operator=(const Doorbell&) = delete;

  /// Thread-safe: yes. Async-signal-safe: yes, errno is preserved. Realtime-safe: yes, this makes one system call that
  /// does not block.
  void ring() noexcept;

  /// Returns true if there is an unanswered ring, without a system call.
  bool rung() const noexcept { return rung_.load(std::memory_order_acquire); }

  /// Resets the bell. UdpLink::wait calls this automatically.
  void answer() noexcept;

  /// Readable while there is an unanswered ring.
  int fd() const noexcept { return fd_; }

 private:
  static_assert(std::atomic<bool>::is_always_lock_free);
  int fd_;
  std::atomic<bool> rung_{false};
};

}  // namespace tendon
