// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <future>
#include <utility>
#include <vector>

#include "clients/softbody/background.h"

namespace tendon::softbody::testing {

/// Collects the second thread's work until work() runs it.
struct Elsewhere {
  Background background() {
    return [this](std::packaged_task<void()> work) { given.push_back(std::move(work)); };
  }
  void work() {
    for (std::packaged_task<void()>& each : std::exchange(given, {})) each();
  }
  std::vector<std::packaged_task<void()>> given;
};

}  // namespace tendon::softbody::testing
