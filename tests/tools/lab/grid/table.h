// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/tools/lab/experiments/experiment.h"
#include "tests/tools/lab/grid/cell.h"
#include "tests/tools/lab/pictures/csv.h"

namespace tendon::lab {

/// What counts as quiet and as passive.
struct Thresholds {
  double vibration = kMostVibration;  ///< m/s
  double given_out = 1e-9;            ///< J
};

struct GridRow {
  GridCell cell;
  Measured measured;
};

/// Empty if it is not known.
std::optional<bool> quiet(const Measured& measured, const Thresholds& thresholds);
std::optional<bool> passive(const Measured& measured, const Thresholds& thresholds);

/// What a table and its figure say about their origin.
struct Origin {
  std::string command;
  std::string scene_sha256;
  std::string commit;
  std::string arithmetic;  ///< of the C library (Fingerprint), because its last bits differ between processors
};
Origin origin_of(std::string command, const std::string& scene_text);

/// A line per row. `parts`: of each law's limiter.
CsvTable table_of(const std::vector<GridRow>& rows, const Thresholds& thresholds, const Origin& origin,
                  const std::map<std::string, std::string>& parts);

}  // namespace tendon::lab
