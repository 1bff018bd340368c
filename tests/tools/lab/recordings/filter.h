// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <ostream>

#include "core/control/limiter.h"

namespace tendon::lab {

struct FilterOptions {
  LimiterConfig limiter;  ///< longest_hold: the period that the law may count on
  bool json = false;      ///< one JSON object for each row instead of CSV
};

/// `tendon-lab filter`: any law of the catalogue on anyone's own recording, row by row, so that it works on a pipe.
///
/// In, CSV with a header: `t_s,x_m,wanted_n` or `t_s,x_m,y_m,z_m,wanted_x_n,wanted_y_n,wanted_z_n`; forces are those on
/// the hand, a wall that resists motion along +x wants −x. Out: the same and `applied_n` (or `applied_x_n` …),
/// `permitted_n` (the bound on the size of the force; `inf` when there is none), `energy_j` (the law's account after
/// the interval that has just ended) and `reason` (empty: applied is what was wanted).
///
/// The motion is what was recorded: it does not answer to the force applied. Each row's force is held until the next.
///
/// A bad row (wrong number of cells, not a finite number, time that does not go on) is named on `errors` with its line
/// number, and nothing is written for it; the force before it is booked as held on. Returns how many there were. Throws
/// std::runtime_error when the header is not one of the two, or when `out` cannot be written.
int filter(const FilterOptions& options, std::istream& in, std::ostream& out, std::ostream& errors);

}  // namespace tendon::lab
