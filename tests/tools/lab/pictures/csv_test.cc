// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/csv.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <string>

#include "tests/support/refusal.h"
#include "tests/tools/sweep/child.h"

namespace tendon::lab::csv_test {
namespace {

TEST(Csv, NumbersHaveSixDigitsAndTextIsQuotedIfNecessary) {
  CsvTable table("tendon-lab x --a 'b c'");
  table.add(JsonLine().add("name", "a,\"b\"").add("third", 1.0 / 3).add("n", 12345678).add("whole", 100.0));
  EXPECT_EQ(table.str(), "# tendon-lab x --a 'b c'\nname,third,n,whole\n\"a,\"\"b\"\"\",0.333333,12345678,100\n");
}

TEST(Csv, UnknownValuesAreEmptyAndANewColumnIsTheLastOne) {
  CsvTable table;
  table.add(JsonLine().add("a", 1).add("b", true));
  table.add(JsonLine().add("b", false).add("c", "x"));
  table.add(JsonLine().add("a", std::numeric_limits<double>::quiet_NaN()).add("c", ""));
  EXPECT_EQ(table.str(), "a,b,c\n1,yes,\n,no,x\n,,\n");
}

TEST(Csv, AListIsNotAField) {
  CsvTable table;
  EXPECT_THROW(table.add(JsonLine().add("a", std::vector<std::string>{"b"})), std::logic_error);
}

TEST(Csv, ReplacesATableButNoOtherFile) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "csv";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  const auto text_of = [](const std::filesystem::path& file) {
    std::ifstream in(file);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  CsvTable table("tendon-lab x");
  table.add(JsonLine().add("a", 1));
  table.write(folder / "x.csv");
  table.add(JsonLine().add("a", 2));
  table.write(folder / "x.csv");
  EXPECT_EQ(text_of(folder / "x.csv"), "# tendon-lab x\na\n1\n2\n");

  std::ofstream(folder / "notes.csv") << "mine\n";
  EXPECT_NE(thrown_by<std::runtime_error>([&] { table.write(folder / "notes.csv"); }).find("notes.csv"),
            std::string::npos);
  EXPECT_EQ(text_of(folder / "notes.csv"), "mine\n");
}

/// Flags, lists and repeated options
TEST(Csv, TheFirstLineIsTheCommandThatRepeatsTheRun) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "csv-command";
  std::filesystem::remove_all(folder);
  const sweep::ChildEnd end =
      sweep::run({.command = {TENDON_LAB, "compare", "--out", folder.string(), "--json", "--kinds", "counts", "--kinds",
                              "tempo", "--laws=aol,feel", "--count", "1", "--held-out"}});
  ASSERT_EQ(end.status, 0) << end.errors;
  std::ifstream table(folder / "compare_kinds.csv");
  std::string line;
  std::getline(table, line);
  EXPECT_EQ(line, "# tendon-lab compare --kinds counts,tempo --count 1 --laws aol,feel --held-out");
}

}  // namespace
}  // namespace tendon::lab::csv_test
