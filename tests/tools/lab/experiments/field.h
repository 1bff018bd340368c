// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/tools/lab/experiments/field_run.h"

namespace tendon::lab {

struct FieldOptions {
  int hands = 5;                                        ///< per row, 1 … 1000
  std::uint64_t seed = 1;                               ///< of the first hand
  std::vector<std::string> scenes{};                    ///< names; empty: all
  std::vector<int> round_trips_ms = {0, 50, 200, 600};  ///< constant, and 5 % of the datagrams of the engine are lost
  std::vector<std::string> networks{};                  ///< named networks that are used instead of the round trips
  double count_um = 0;                                  ///< of the encoders; 0: exact
  int milliseconds = 6000;                              ///< of each run, above 500
  bool far = false;                                     ///< only the picture of far_field
  std::optional<std::filesystem::path> out{};           ///< folder for field.csv and the figure
  std::string command{};                                ///< repeats the run
  bool json = false;
};

/// The mean over all hands, or the maximum of the jumps and the minimum of the energies.
struct FieldRow {
  const FieldScene* scene = nullptr;
  FieldMethod method = FieldMethod::kHeld;
  bool ahead = true;  ///< FieldCase::ahead
  field::EnergyGate::Config push{};
  std::string network;  ///< "200 ms", or its name
  FieldRun mean{};
};

/// Throws std::invalid_argument if a scene, a network or a number is not known.
std::vector<FieldRow> field_rows(const FieldOptions& options);

/// Prints a table of the errors of all methods, and writes the files to `out`.
void field_experiment(const FieldOptions& options, std::ostream& out);

/// Draws far.svg and far.png, which show the forces on one hand at round trips of 200 and 600 ms.
void draw_far_field(const FieldOptions& options, std::ostream& out);

}  // namespace tendon::lab
