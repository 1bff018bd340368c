// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/lab/experiments/accuracy.h"
#include "tests/tools/lab/experiments/accuracy_table.h"

namespace tendon::lab {

/// A model that is there for comparison: drawn dashed, and no answer to which one to take.
bool for_comparison(softbody::ModelKind kind);

/// The figures of `tendon-lab accuracy`, in the folder `options.out`. `round_trip_ms`: of the network, if there is one.
void draw(const AccuracyOptions& options, const Ladders& ladders, double round_trip_ms);

}  // namespace tendon::lab
