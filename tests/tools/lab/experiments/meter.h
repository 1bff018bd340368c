// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>

namespace tendon::lab {

struct TooSlow : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Time and instructions: the lab's only clock.
///
///     const Meter::Reading before = meter.read();
///     work();
///     const Meter::Reading cost = meter.read() - before;
class Meter {
 public:
  struct Reading {
    double wall = 0;                              ///< s
    double processor = 0;                         ///< s, the sum over all threads of the process
    std::optional<std::uint64_t> instructions{};  ///< user-space instructions of the thread that created the meter

    Reading operator-(const Reading& before) const;
  };

  Meter();
  ~Meter();
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;

  Reading read() const;

 private:
  int counter_ = -1;  ///< file descriptor; −1 if the kernel does not permit counting
};

}  // namespace tendon::lab
