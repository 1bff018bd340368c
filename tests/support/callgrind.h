// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/server/scratch_folder.h"

namespace tendon::testing {

struct Counted {
  std::string line;
  double instructions = 0;  ///< difference between the longer run and the shorter run
};

/// For every line that it prints, `program` calls its extern "C" `function` twice, first for the shorter run. Only
/// instructions within that function are counted. Throws std::runtime_error if the program fails or valgrind is
/// missing.
inline std::vector<Counted> count_instructions(const std::string& program, const std::string& argument,
                                               const std::string& function) {
  const ScratchFolder folder;
  const auto total = [&](std::size_t file) {
    std::ifstream stream(folder.path() / ("count." + std::to_string(file)));
    for (std::string line; std::getline(stream, line);) {
      if (line.starts_with("totals: ") || line.starts_with("summary: ")) return std::stod(line.substr(line.find(' ')));
    }
    throw std::runtime_error("callgrind's file " + std::to_string(file) + " of " + program + " has no total");
  };
  const std::string command =
      "cd " + folder.path().string() +
      " && OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 valgrind -q --tool=callgrind --toggle-collect=" + function +
      " --dump-after=" + function + " --callgrind-out-file=count " + program + " " + argument + " > lines";
  // NOLINTNEXTLINE(concurrency-mt-unsafe): one thread
  if (std::system(command.c_str()) != 0) throw std::runtime_error("this failed: " + command);
  std::vector<Counted> all;
  std::ifstream lines(folder.path() / "lines");
  for (std::string line; std::getline(lines, line);) {
    const std::size_t before = 2 * all.size();
    all.push_back({line, total(before + 2) - total(before + 1)});
  }
  return all;
}

}  // namespace tendon::testing
