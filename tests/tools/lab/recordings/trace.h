// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "core/base/time.h"
#include "server/recording/records.h"

namespace tendon::lab {

/// The least and the largest of some values, and which came first.
struct Extremes {
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  bool least_first = true;

  bool empty() const noexcept { return least > most; }
  /// A value that is not a number says nothing.
  void observe(double value) noexcept;
  void observe(const Extremes& other) noexcept;
  double first() const noexcept { return least_first ? least : most; }
  double second() const noexcept { return least_first ? most : least; }
};

/// A run as it is drawn: cut into columns of equal time, each with the extremes of what happened in it. However long
/// the run and however narrow the picture, no spike is lost and a buzz stays as tall as it was.
///
/// Thread-safe: no. Realtime-safe: no.
class Trace {
 public:
  struct Config {
    LocalTime start{};
    Duration span{};            ///< > 0
    std::size_t columns = 1;    ///< > 0
    Vec3 axis = Vec3::UnitX();  ///< position and forces are taken along it
  };
  /// All empty when the column has no step.
  struct Column {
    Extremes position;   ///< m
    Extremes wanted;     ///< N
    Extremes applied;    ///< N
    Extremes permitted;  ///< N, of the bounds that are finite
    Extremes energy;     ///< J
    bool overrun = false;

    bool empty() const noexcept { return energy.empty(); }
  };

  /// Throws std::invalid_argument when span or columns is not above zero.
  explicit Trace(const Config& config);

  /// A step outside of [start, start + span] is left out. A position that was not seen is not drawn.
  void observe(const StepRecord& step);

  const std::vector<Column>& columns() const noexcept { return columns_; }
  /// The middle of a column, s after the start.
  double time(std::size_t column) const noexcept;
  const Config& config() const noexcept { return config_; }

 private:
  Config config_;
  std::vector<Column> columns_;
};

}  // namespace tendon::lab
