// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::testing {

/// One line that a program printed, and the instructions counted for it.
struct Counted {
  std::string line;
  double instructions = 0;  ///< of the longer of two runs, beyond those of the shorter
};

/// Runs `program argument` under callgrind. The program calls its extern "C" function `function` twice for every line
/// that it prints, at first for the shorter run; instructions are counted within that function alone.
inline std::vector<Counted> count_instructions(const std::string& program, const std::string& argument,
                                               const std::string& function) {
  std::string folder = std::filesystem::temp_directory_path() / "tendon-proof-XXXXXX";
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("no temporary folder");
  const auto total = [&](std::size_t file) {
    std::ifstream stream(folder + "/count." + std::to_string(file));
    for (std::string line; std::getline(stream, line);) {
      if (line.starts_with("totals: ") || line.starts_with("summary: ")) return std::stod(line.substr(line.find(' ')));
    }
    ADD_FAILURE() << "callgrind's file " << file << " has no total";
    return 0.0;
  };
  const std::string command =
      "cd " + folder +
      " && OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 valgrind -q --tool=callgrind --toggle-collect=" + function +
      " --dump-after=" + function + " --callgrind-out-file=count " + program + " " + argument + " > lines";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  std::vector<Counted> all;
  std::ifstream lines(folder + "/lines");
  for (std::string line; std::getline(lines, line);) {
    const std::size_t before = 2 * all.size();
    all.push_back({line, total(before + 2) - total(before + 1)});
  }
  std::filesystem::remove_all(folder);
  return all;
}

/// For tests that count instructions; they are skipped without valgrind.
class InstructionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v valgrind > /dev/null") != 0) GTEST_SKIP() << "skipped: there is no valgrind";
  }
};

}  // namespace tendon::testing
