// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/tools/lab/experiments/accuracy.h"

namespace tendon::lab {

// What `tendon-lab accuracy` writes: rows for people, CSV, and the answer to --budget-ms.

/// A ladder is one model and element on finer and finer meshes; none is empty.
using Ladders = std::vector<std::vector<AccuracyPoint>>;

extern const char* const kHeading;
void write_row(std::ostream& out, const AccuracyPoint& p);
extern const char* const kFeltHeading;
void write_felt(std::ostream& out, const AccuracyPoint& p);
void write_truth(std::ostream& out, Truth& truth);
/// What refining costs: a line for each ladder.
void write_exponents(std::ostream& out, const Ladders& ladders);
/// Which one to take.
void write_answer(std::ostream& out, const AccuracyOptions& options, const std::optional<AccuracyPoint>& best,
                  Truth& truth);
void write_csv(const std::filesystem::path& file, const std::vector<AccuracyPoint>& points, Truth& truth);

/// "0.3 N"
std::string load_text(double newtons);

}  // namespace tendon::lab
