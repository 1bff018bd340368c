// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <stdexcept>

namespace tendon::lab {

/// Something costs more time than was asked for.
struct TooSlow : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What something costs: the lab's only look at a clock, and at the processor's counter of instructions.
///
///     const Meter meter;
///     const Meter::Reading before = meter.read();
///     work();
///     const Meter::Reading cost = meter.read() - before;
class Meter {
 public:
  struct Reading {
    double wall = 0;       ///< s
    double processor = 0;  ///< s, of all threads of the process: what it would take on one core that nobody else uses
    std::optional<std::uint64_t> instructions{};  ///< of the thread that made the meter, in user space

    Reading operator-(const Reading& before) const;
  };

  Meter();
  ~Meter();
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;

  Reading read() const;

 private:
  int counter_ = -1;  ///< a file; −1 when the kernel does not let us count
};

}  // namespace tendon::lab
