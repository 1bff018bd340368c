// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/lab/experiments/accuracy.h"
#include "tests/tools/lab/experiments/accuracy_table.h"

namespace tendon::lab {

/// Draws the figures of `tendon-lab accuracy` in the folder `options.out`. `round_trip_ms` is the round trip of the
/// network, or 0 if there is no network.
void draw(const AccuracyOptions& options, const Ladders& ladders, double round_trip_ms);

}  // namespace tendon::lab
