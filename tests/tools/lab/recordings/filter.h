// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <ostream>
#include <string>
#include <vector>

#include "core/control/limiter.h"

namespace tendon::lab {

/// Which law, as the command line says it.
struct FilterLaw {
  std::string name = "aol+";  ///< of core/control/limiter.h
  double viscous = 0;         ///< N·s/m, lower bound of the device's friction
  double coulomb = 0;         ///< N, lower bound of the device's friction
  double period_us = 1000;    ///< the longest that a force is held
  /// "TABLE.KEY=VALUE", as `parse_scene` takes them and as tendon-replay does: parts of AOL+ and whatever else a
  /// scene's limiter may have. They come after the four above.
  std::vector<std::string> settings = {};
};

/// The limiter of a scene that has this law and nothing else. Throws SceneError, naming the key, when a value is
/// impossible.
LimiterConfig limiter_of(const FilterLaw& law);

struct FilterOptions {
  LimiterConfig limiter;  ///< longest_hold: the period that the law may count on
  bool json = false;      ///< one JSON object for each row instead of CSV
};

/// `tendon-lab filter`: any law of the catalogue on anyone's own recording, row by row, so that it works on a pipe.
///
/// The input is a table for TableReader with the columns `t_s,x_m,wanted_n` or
/// `t_s,x_m,y_m,z_m,wanted_x_n,wanted_y_n,wanted_z_n`. The forces act on the hand, so a wall that resists motion along +x
/// has a force along −x. The output is CSV with the same columns and these: `applied_n` (or `applied_x_n` …),
/// `permitted_n` (the limit of the force, or `inf`), `energy_j` (the account of the law after the last interval) and
/// `reason` (empty if the applied force is the wanted force).
///
/// The motion is what was recorded: it does not answer to the force applied. Each row's force is held until the next.
///
/// If a row is bad, it writes the file and line to `errors` and nothing to `out`, and the previous force is held. A row is
/// bad if TableReader refuses it or if the time does not increase. It returns the number of bad rows. It throws
/// std::runtime_error if the header is not one of the two, or if it cannot write to `out`.
int filter(const FilterOptions& options, std::istream& in, std::ostream& out, std::ostream& errors);

}  // namespace tendon::lab
