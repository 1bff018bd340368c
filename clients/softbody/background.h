// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <future>
#include <thread>

namespace tendon::softbody {

/// Runs work once, on any thread; not during an answer unless factors_may_work_at_once(). The work owns its data.
using Background = std::function<void(std::packaged_task<void()>)>;

/// A worker thread that runs tasks in order. It runs at nice 5, so on a single processor answers take precedence.
/// Thread-safe: yes. Realtime-safe: give() takes no lock and does not wait.
class BackgroundThread {
 public:
  BackgroundThread();
  ~BackgroundThread();  ///< waits for the running task; drops the others
  BackgroundThread(const BackgroundThread&) = delete;
  BackgroundThread& operator=(const BackgroundThread&) = delete;

  void give(std::packaged_task<void()> work);

 private:
  struct Task;
  void put(Task* last);
  void run();

  std::atomic<Task*> given_{nullptr};
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

}  // namespace tendon::softbody
