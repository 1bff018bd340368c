// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/background.h"

#include <sys/resource.h>
#include <unistd.h>

#include <memory>
#include <utility>

namespace tendon::softbody {
namespace {

constexpr int kNice = 5;

}  // namespace

struct BackgroundThread::Task {
  std::packaged_task<void()> work;
  Task* before = nullptr;
};

BackgroundThread::BackgroundThread() : thread_([this] { run(); }) {}

BackgroundThread::~BackgroundThread() {
  ends_ = true;
  put(new Task);  // wakes the thread
  thread_.join();
  for (Task* left = given_; left != nullptr;) delete std::exchange(left, left->before);
}

void BackgroundThread::give(std::packaged_task<void()> work) { put(new Task{std::move(work)}); }

void BackgroundThread::put(Task* last) {
  last->before = given_.load(std::memory_order_relaxed);
  while (!given_.compare_exchange_weak(last->before, last, std::memory_order_acq_rel)) {
  }
  given_.notify_one();
}

void BackgroundThread::run() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kNice);  // on Linux this affects the calling thread only
  while (!ends_) {
    given_.wait(nullptr);
    std::unique_ptr<Task> first;
    for (Task* left = given_.exchange(nullptr, std::memory_order_acq_rel); left != nullptr;) {
      std::unique_ptr<Task> next(std::exchange(left, left->before));
      next->before = first.release();
      first = std::move(next);
    }
    while (first) {
      if (!ends_) first->work();
      first.reset(first->before);
    }
  }
}

}  // namespace tendon::softbody
