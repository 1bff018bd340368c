// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

/// Union-find: connected items form a group.
class Groups {
 public:
  explicit Groups(std::size_t size) : of_(size) { std::iota(of_.begin(), of_.end(), 0); }
  int find(int item) {
    while (of_[at(item)] != item) item = of_[at(item)] = of_[at(of_[at(item)])];
    return item;
  }
  void unite(int a, int b) {
    a = find(a);
    b = find(b);
    of_[at(std::max(a, b))] = std::min(a, b);
  }

 private:
  std::vector<int> of_;
};

}  // namespace tendon::softbody
