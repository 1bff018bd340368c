// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "core/control/limiter.h"

namespace tendon::lab {

struct FilterLaw {
  std::string name = "aol+";  ///< a name of core/control/limiter.h
  double viscous = 0;         ///< N·s/m, lower bound of the device's friction
  double coulomb = 0;         ///< N, lower bound of the device's friction
  double period_us = 1000;    ///< µs, the maximum time between forces
  /// "TABLE.KEY=VALUE" in the syntax of `parse_scene`, such as parts of AOL+. Applied after the fields above.
  std::vector<std::string> settings = {};
};

/// Throws SceneError, naming the key, for an invalid value.
LimiterConfig limiter_of(const FilterLaw& law);

struct FilterOptions {
  LimiterConfig limiter;  ///< longest_hold: the period assumed by the law
  bool json = false;      ///< one JSON object per row instead of CSV
};

/// Applies a law to a recorded motion, row by row, so it can be used in a pipe. The motion does not respond to the
/// applied force, which is held until the next row.
///
/// The input is a table for TableReader with the columns `t_s,x_m,wanted_n` or
/// `t_s,x_m,y_m,z_m,wanted_x_n,wanted_y_n,wanted_z_n`. The forces act on the hand, so a wall that resists motion along
/// +x has a force along −x. The output is CSV with these columns plus `applied_n` (or `applied_x_n` …), `permitted_n`
/// (bound of the force, or `inf`), `energy_j` (the law's account after the last interval) and `reason` (empty if the
/// applied force is the wanted one).
///
/// A row that TableReader rejects, or whose time does not increase, is reported to `errors` with file and line, and the
/// previous force is held. Returns the number of such rows. Throws std::runtime_error if the header is neither of the
/// two or writing to `out` fails.
int filter(const FilterOptions& options, std::istream& in, std::ostream& out, std::ostream& errors);

}  // namespace tendon::lab
