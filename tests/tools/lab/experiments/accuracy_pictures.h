// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/lab/experiments/accuracy.h"
#include "tests/tools/lab/experiments/accuracy_table.h"

namespace tendon::lab {

/// Writes to the folder `options.out`. `round_trip_ms`: 0 without a network.
void draw(const AccuracyOptions& options, const Ladders& ladders, double round_trip_ms);

}  // namespace tendon::lab
