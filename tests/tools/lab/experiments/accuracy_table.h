// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/accuracy.h"

namespace tendon::lab {

/// A ladder is one model and element on increasingly fine meshes. None is empty.
using Ladders = std::vector<std::vector<AccuracyPoint>>;

struct TruthFigures {
  double linear = 0;  ///< N/m for small strains
  double small = 0;   ///< N/m under the smaller load
  double hard = 0;    ///< N/m under the larger load
  double uncertainty = 0;
};
TruthFigures figures_of(Truth& truth);

struct MeshErrors {
  AccuracyPoint point;
  TruthFigures truth{};
  std::string left_out{};  ///< reason for a missing point
};
/// All clock-independent numbers. read_errors() is its inverse.
JsonLine line_of(const MeshErrors& errors);
MeshErrors read_errors(const Candidate& candidate, const nlohmann::json& line);

std::string heading(bool timed);
void write_row(std::ostream& out, const AccuracyPoint& p);
extern const char* const kFeltHeading;
void write_felt(std::ostream& out, const AccuracyPoint& p);
void write_truth(std::ostream& out, const TruthFigures& truth, const PressedBlock& block);
void write_exponents(std::ostream& out, const Ladders& ladders);
void write_answer(std::ostream& out, const AccuracyOptions& options, const std::optional<AccuracyPoint>& best,
                  Truth& truth);
JsonLine json_of(const AccuracyPoint& point, const TruthFigures& truth, const PressedBlock& block);

std::string load_text(double newtons);

}  // namespace tendon::lab
