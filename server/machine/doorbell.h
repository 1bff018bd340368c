// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace tendon {

/// Wakes a thread from another one or a signal handler, by an eventfd. Rings are counted as one until `answer`.
class Doorbell {
 public:
  Doorbell();  ///< throws std::system_error if there are no file descriptors left
  ~Doorbell();
  Doorbell(const Doorbell&) = delete;
  Doorbell& operator=(const Doorbell&) = delete;

  /// Thread-safe: yes. Async-signal-safe: yes, errno is preserved. Realtime-safe: yes, one system call that does not
  /// block.
  void ring() noexcept;

  /// Returns true if there is an unanswered ring, without a system call.
  bool rung() const noexcept { return rung_.load(std::memory_order_acquire); }

  void answer() noexcept;

  int fd() const noexcept { return fd_; }  ///< readable while there is an unanswered ring

 private:
  static_assert(std::atomic<bool>::is_always_lock_free);
  int fd_;
  std::atomic<bool> rung_{false};
};

}  // namespace tendon
