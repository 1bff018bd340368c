// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/tools/bench/row.h"
#include "tests/tools/lab/experiments/meter.h"

namespace tendon::bench {

/// Keeps the compiler from removing or constant-folding `value`.
template <class T>
void keep(T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

inline double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// Measures two calls that alternate, so that other load affects both equally.
struct Turns {
  std::size_t n = 0;          ///< calls of each
  std::vector<double> times;  ///< the time per call in ns for each block
  std::vector<double> floor_times;
  std::vector<double> ratios;
  std::optional<double> instructions{};  ///< median per call, if available
};

/// Discards the first pair of blocks, which runs with cold caches.
template <class Subject, class Floor>
Turns in_turns(std::size_t blocks, std::size_t calls, Subject subject, Floor floor) {
  const lab::Meter meter;
  const auto block = [&](auto& call) {
    const lab::Meter::Reading before = meter.read();
    for (std::size_t i = 0; i < calls; ++i) call(i);
    return meter.read() - before;
  };
  Turns turns{.n = blocks * calls, .times = {}, .floor_times = {}, .ratios = {}};
  std::vector<double> instructions;
  for (std::size_t b = 0; b < blocks + 1; ++b) {
    const lab::Meter::Reading of_floor = block(floor);
    const lab::Meter::Reading of_subject = block(subject);
    if (b == 0) continue;
    turns.times.push_back(1e9 * of_subject.wall / static_cast<double>(calls));
    turns.floor_times.push_back(1e9 * of_floor.wall / static_cast<double>(calls));
    turns.ratios.push_back(of_subject.wall / of_floor.wall);
    if (of_subject.instructions) {
      instructions.push_back(static_cast<double>(*of_subject.instructions) / static_cast<double>(calls));
    }
  }
  if (!instructions.empty()) turns.instructions = quantile(instructions, 0.5);
  return turns;
}

inline Row row_of(const Turns& turns, std::string what, std::string floor) {
  return {.section = {},
          .what = std::move(what),
          .unit = "ns",
          .n = turns.n,
          .p50 = quantile(turns.times, 0.5),
          .p99 = quantile(turns.times, 0.99),
          .floor = std::move(floor),
          .floor_p50 = quantile(turns.floor_times, 0.5),
          .floor_p99 = quantile(turns.floor_times, 0.99),
          .ratio = quantile(turns.ratios, 0.5),
          .instructions = turns.instructions,
          .note = {}};
}

}  // namespace tendon::bench
