// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/accuracy.h"

namespace tendon::lab {

// What `tendon-lab accuracy` writes: rows for people, CSV, and the answer to --budget-ms.

/// A ladder is one model and element on finer and finer meshes; none is empty.
using Ladders = std::vector<std::vector<AccuracyPoint>>;

/// What is said of the truth, and stays when it is gone.
struct TruthFigures {
  double linear = 0;  ///< N/m while strains are small
  double small = 0;   ///< N/m under the small load
  double hard = 0;    ///< N/m under the hard one
  double uncertainty = 0;
};
TruthFigures figures_of(Truth& truth);

/// What a mesh comes to without a clock.
struct MeshErrors {
  AccuracyPoint point;
  TruthFigures truth{};
  std::string left_out{};  ///< why there is no point
};
/// As a line of JSON with all numbers that are there without a clock, and read again.
JsonLine line_of(const MeshErrors& errors);
MeshErrors read_errors(const Candidate& candidate, const nlohmann::json& line);

std::string heading(bool timed);
void write_row(std::ostream& out, const AccuracyPoint& p);
extern const char* const kFeltHeading;
void write_felt(std::ostream& out, const AccuracyPoint& p);
void write_truth(std::ostream& out, const TruthFigures& truth, const PressedBlock& block);
/// What refining costs: a line for each ladder.
void write_exponents(std::ostream& out, const Ladders& ladders);
/// Which one to take.
void write_answer(std::ostream& out, const AccuracyOptions& options, const std::optional<AccuracyPoint>& best,
                  Truth& truth);
void write_csv(const std::filesystem::path& file, const std::vector<AccuracyPoint>& points, const TruthFigures& truth,
               const PressedBlock& block);
std::string to_json(const AccuracyPoint& point, const TruthFigures& truth, const PressedBlock& block);

/// "0.3 N"
std::string load_text(double newtons);

}  // namespace tendon::lab
