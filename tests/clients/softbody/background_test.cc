// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/background.h"

#include <gtest/gtest.h>

#include <future>
#include <numeric>
#include <utility>
#include <vector>

namespace tendon::softbody::background_test {
namespace {

TEST(BackgroundThread, DoesWhatItIsGivenInItsOrder) {
  constexpr int kCount = 2000;
  std::vector<int> done;
  std::promise<void> all;
  {
    BackgroundThread thread;
    for (int i = 0; i < kCount; ++i) {
      thread.give(std::packaged_task<void()>([&, i] {
        done.push_back(i);
        if (i + 1 == kCount) all.set_value();
      }));
    }
    all.get_future().wait();
  }
  std::vector<int> expected(kCount);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(done, expected);
}

TEST(BackgroundThread, FinishesWhatItHasBegun) {
  std::promise<void> begun;
  std::promise<void> go_on;
  bool finished = false;
  {
    BackgroundThread thread;
    thread.give(std::packaged_task<void()>([&] {
      begun.set_value();
      go_on.get_future().wait();
      finished = true;
    }));
    begun.get_future().wait();
    go_on.set_value();
  }
  EXPECT_TRUE(finished);
}

TEST(BackgroundThread, WorkThatThrowsIsNotItsLast) {
  BackgroundThread thread;
  thread.give(std::packaged_task<void()>([] { throw 1; }));
  std::packaged_task<void()> next([] {});
  std::future<void> done = next.get_future();
  thread.give(std::move(next));
  done.get();
}

}  // namespace
}  // namespace tendon::softbody::background_test
