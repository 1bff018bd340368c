// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "core/base/time.h"
#include "server/recording/records.h"

namespace tendon::lab {

struct Extremes {
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  bool least_first = true;

  bool empty() const noexcept { return least > most; }
  /// Ignores NaN.
  void observe(double value) noexcept;
  void observe(const Extremes& other) noexcept;
  double first() const noexcept { return least_first ? least : most; }
  double second() const noexcept { return least_first ? most : least; }
};

/// A run prepared for plotting: divided into columns of equal duration, each with the extremes of its values, so that
/// no spike is lost at any resolution. Thread-safe: no. Realtime-safe: no.
class Trace {
 public:
  struct Config {
    LocalTime start{};
    Duration span{};            ///< > 0
    std::size_t columns = 1;    ///< > 0
    Vec3 axis = Vec3::UnitX();  ///< direction of the position and forces shown
  };
  struct Column {
    Extremes position;   ///< m
    Extremes wanted;     ///< N
    Extremes applied;    ///< N
    Extremes permitted;  ///< N, finite bounds only
    Extremes energy;     ///< J
    bool overrun = false;

    bool empty() const noexcept { return energy.empty(); }
  };

  /// Throws std::invalid_argument if the span or the number of columns is not positive.
  explicit Trace(const Config& config);

  /// Ignores steps outside [start, start + span] and positions that were not measured.
  void observe(const StepRecord& step);

  const std::vector<Column>& columns() const noexcept { return columns_; }
  double time(std::size_t column) const noexcept;
  const Config& config() const noexcept { return config_; }

 private:
  Config config_;
  std::vector<Column> columns_;
};

}  // namespace tendon::lab
