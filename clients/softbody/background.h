// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <thread>

namespace tendon::softbody {

/// Takes work that answers must not wait for: calls it once, on any thread, at any time. The work owns all that it
/// touches. Where factors_may_work_at_once() is false it must not be done beside an answer.
using Background = std::function<void(std::packaged_task<void()>)>;

/// The thread beside the answers. It does what it is given one after the other, in that order, and rests in between. It
/// gives way to other threads (nice 5): where there is only one processor an answer comes first.
///
/// Thread-safe: yes. Realtime-safe: give() takes no lock and does not wait.
class BackgroundThread {
 public:
  BackgroundThread();
  /// Waits for the work that has begun. The rest is not done.
  ~BackgroundThread();
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

  void give(std::packaged_task<void()> work);

 private:
  struct Given;
  void put(Given* last);
  void run();

  std::atomic<Given*> given_{nullptr};  ///< the last first
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace tendon::softbody
