// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/golden/golden.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>

#include "core/control/limiter.h"

namespace tendon::lab::golden_test {
namespace {

TEST(Golden, EveryLawDoesWhatTheCommittedTableSays) {
  const auto found = differences(read_golden(TENDON_GOLDEN "/laws.csv"), golden_laws());
  EXPECT_TRUE(found.empty()) << to_text(found)
                             << "If the change is meant: tendon-lab golden --write, and commit the table with it.";
}

TEST(Golden, EveryLawAndEveryExperimentIsInTheTable) {
  const GoldenTable table = read_golden(TENDON_GOLDEN "/laws.csv");
  EXPECT_GE(table.rows.size(), 200U);
  for (const LawInfo& law : laws()) {
    const auto rows = std::ranges::count(table.rows, law.name, &GoldenTable::Row::law);
    EXPECT_GE(rows, 12) << law.name;
  }
}

TEST(Golden, ATableThatIsWrittenIsReadBackTheSame) {
  const GoldenTable table = read_golden(TENDON_GOLDEN "/laws.csv");
  std::ostringstream text;
  write(text, table);
  std::ifstream file(TENDON_GOLDEN "/laws.csv");
  std::ostringstream committed;
  committed << file.rdbuf();
  EXPECT_EQ(text.str(), committed.str());
}

TEST(Golden, ADifferenceNamesLawSituationFigureAndBothValues) {
  const GoldenTable was{{"a_n", "gone_j"}, {{"aol", "here", {"1", "2"}}, {"aol", "there", {"3", "4"}}}};
  const GoldenTable is{{"a_n", "new_m"}, {{"aol", "here", {"1.5", "7"}}, {"aol+", "here", {"5", "6"}}}};
  EXPECT_EQ(to_text(differences(was, is)),
            "law   situation  figure  was  is\n"
            "aol   here       a_n     1    1.5\n"
            "aol   here       new_m        7\n"
            "aol+  here       a_n          5\n"
            "aol+  here       new_m        6\n"
            "aol   here       gone_j  2    \n"
            "aol   there      a_n     3    \n"
            "aol   there      gone_j  4    \n");
  EXPECT_TRUE(differences(was, was).empty());
}

/// Makes glibc select the variants of sin, exp … for processors without FMA.
constexpr const char* kWithoutFma = "GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4 ";

std::uint64_t bits_of_libm() {
  std::uint64_t bits = 0;
  for (int i = 1; i < 20'000; ++i) {
    bits = bits * 31 + std::bit_cast<std::uint64_t>(std::sin(i * 0.37) + std::exp(-i * 1e-3));
  }
  return bits;
}

struct Ran {
  int exit = -1;
  std::string out;
};

Ran shell(const std::string& command) {
  Ran result;
  FILE* const pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return result;
  for (int c = 0; (c = std::fgetc(pipe)) != EOF;) result.out += static_cast<char>(c);
  const int status = pclose(pipe);
  result.exit = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

TEST(GoldenChild, DISABLED_SaysTheBitsOfLibm) { std::cout << "bits of libm: " << bits_of_libm() << "\n"; }

TEST(Golden, NoFigureDependsOnTheProcessorsFusedMultiplyAdd) {
  const Ran other = shell(kWithoutFma + std::string(TENDON_LAB_TEST) +
                          " --gtest_also_run_disabled_tests --gtest_filter=GoldenChild.*");
  const auto at = other.out.find("bits of libm: ");
  ASSERT_NE(at, std::string::npos) << other.out;
  if (std::stoull(other.out.substr(at + 14)) == bits_of_libm()) {
    GTEST_SKIP() << "skipped: on this machine libm is the same either way";
  }
  const Ran lab = shell(kWithoutFma + std::string(TENDON_LAB " golden " TENDON_GOLDEN));
  EXPECT_EQ(lab.exit, 0) << lab.out;
}

}  // namespace
}  // namespace tendon::lab::golden_test
