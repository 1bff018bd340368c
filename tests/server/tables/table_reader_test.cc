// SPDX-License-Identifier: Apache-2.0
#include "server/tables/table_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/refusal.h"

namespace tendon::table_reader_test {
namespace {

using Rows = std::vector<std::vector<std::optional<double>>>;

Rows rows_of(TableReader& table) {
  Rows rows;
  while (table.next_row()) {
    auto& row = rows.emplace_back();
    for (std::size_t i = 0; i < table.width(); ++i) row.push_back(table.number({.index = i}));
  }
  return rows;
}

Rows read(const std::string& text, const TableReader::Options& options = {}) {
  std::istringstream from(text);
  TableReader table(from, "t.csv", options);
  return rows_of(table);
}

std::string refusal(const std::string& text, const TableReader::Options& options = {}) {
  return thrown_by<std::runtime_error>([&] { read(text, options); });
}

const Rows kSome = {{0, 20.5}, {0.5, -3}};

TEST(TableReader, ReadsWhatLoggersAndSpreadsheetsWrite) {
  for (const char* text : {"t_s,x_mm\n0,20.5\n0.5,-3\n", "0,20.5\n0.5,-3",
                           "\xef\xbb\xbft_s,x_mm\r\n0,20.5\r\n0.5,-3\r\n",          // Windows spreadsheet
                           "\xef\xbb\xbf\"t_s\";\"x_mm\"\r\n0;20,5\r\n0,5;-3\r\n",  // with a decimal comma
                           "\"t_s\",\"x_mm\"\n\"0\",\"20,5\"\n\"0,5\",\"-3\"\n", "t_s\tx_mm\n0\t20,5\n0,5\t-3\n",
                           "# by a logger\n\nt_s , x_mm\n 0 , +20.5\n\n# a pause\n5e-1, -3.0 \n\n",
                           "t_s x_mm\n0 20.5\n 0.5   -3\n", "\"time, \"\"true\"\"\";x\n0;20.5\n0.5;-3\n"}) {
    EXPECT_EQ(read(text), kSome) << text;
  }
  EXPECT_EQ(read(""), Rows());
  EXPECT_EQ(read("\n \n# nothing\n"), Rows());
  EXPECT_EQ(read("Delay [ms]\n1\n"), Rows({{1}}));
  EXPECT_EQ(read("a,b\n1,\n,2\n"), Rows({{1, std::nullopt}, {std::nullopt, 2}}));
}

TEST(TableReader, BlankLinesAndCommentsAreRowsOnlyWhereTheyMayBe) {
  EXPECT_EQ(read("1\n\n2\n"), Rows({{1}, {2}}));
  EXPECT_EQ(read("\n1\n\n# no row\n2\n\n", {.blank_lines_are_cells = true}),
            Rows({{1}, {std::nullopt}, {2}, {std::nullopt}}));
  EXPECT_EQ(read("1,2\n\n3,4\n", {.blank_lines_are_cells = true}), Rows({{1, 2}, {3, 4}}));
  EXPECT_EQ(read("1,2 # a comment\n3,4\t#\n", {.trailing_comments = true}), Rows({{1, 2}, {3, 4}}));
  EXPECT_EQ(read("sample #,x\n1,2\n", {.trailing_comments = true}), Rows({{1, 2}}));
}

TEST(TableReader, NamesFileLineAndWhatWasExpected) {
  for (const auto& [text, says] : std::vector<std::pair<std::string, std::string>>{
           {"a,b\n1,2\n3,4,5\n",
            "3: expected 2 cells as in the first row, found 3; are these decimal commas? Use decimal points, or "
            "separate the cells by semicolons"},
           {"a;b\n1;2\n3\n", "3: expected 2 cells as in the first row, found 1"},
           {"delay_ms\n20,1\n",
            "2: expected 1 cell as in the first row, found 2; are these decimal commas? Use decimal points, or "
            "separate the cells by semicolons"},
           {"a,b\n1,two\n", "2: expected a finite number as b, found 'two'"},
           {"1,2\n3,two\n", "2: expected a finite number in column 1 (from 0), found 'two'"},
           {"1,nan\n", "1: expected a finite number in column 1 (from 0), found 'nan'"},
           {"a,b\n1,inf\n", "2: expected a finite number as b, found 'inf'"},
           {"1e999\n", "1: expected a finite number, found '1e999'"},
           {"a\n1.5D3\n", "2: expected a finite number as a, found '1.5D3'"},
           {"a,b\n\"1,2\n", "2: expected a closing quote in the same line, found '\"1,2'"},
           {"a,b\n\"1\"x,2\n", "2: expected a separator after a cell in quotes, found 'x,2'"},
           {"a;b\n1;2,5\n1.5;2\n", "3: expected a decimal comma as in line 2, found '1.5'"},
           {"a;b\n1.5;2\n1;2,5\n", "3: expected a decimal point as in line 2, found '2,5'"},
           {"a,b\n1,\x1b[2J\n", "2: expected a finite number as b, found '?[2J'"},
           {"a;b\n1;1.012,5\n", "2: expected a number without thousands separators, found '1.012,5'"},
           {"a\tb\n1\t1,012\n", "2: expected a decimal point, found '1,012': is it 1.012 or 1012?"},
           {"a,b\n1,\"1,012\"\n", "2: expected a decimal point, found '1,012': is it 1.012 or 1012?"},
           {"\xff\xfe" + std::string("a\0", 2), "1: expected text in UTF-8, found UTF-16: save it as \"CSV UTF-8\""}}) {
    EXPECT_EQ(refusal(text), "t.csv:" + says) << text;
  }
  EXPECT_EQ(read("a\tb\n0,5\t1,012\n"), Rows({{0.5, 1.012}}));
  EXPECT_EQ(read("a;b\n1;1,012\n"), Rows({{1, 1.012}}));
}

TEST(TableReader, ALineThatNeverEndsIsRefused) {
  EXPECT_EQ(refusal(std::string(1'000'000, '\0')),
            "t.csv:1: expected lines of at most 65536 bytes, found a longer one");
  EXPECT_EQ(read("1,2" + std::string(TableReader::kMaxLine - 3, ' ') + "\n"), Rows({{1, 2}}));
}

TEST(TableReader, ReadsOnAfterABadRow) {
  std::istringstream from("a,b\n1,2\n1\n3,4\n");
  TableReader table(from, "t.csv");
  EXPECT_TRUE(table.next_row());
  EXPECT_THROW(table.next_row(), std::runtime_error);
  EXPECT_TRUE(table.next_row());
  EXPECT_EQ(table.needed_number({.index = 1}), 4);
  EXPECT_FALSE(table.next_row());
}

double in(const std::string& header, const std::string& wanted, const std::string& number = "2.5") {
  std::istringstream from(header + ";other\n" + number + ";1\n");
  TableReader table(from, "t.csv");
  const auto column = table.column(wanted);
  table.next_row();
  return table.needed_number(column);
}

TEST(TableReader, ConvertsNumbersByTheUnitsInTheNames) {
  EXPECT_EQ(in("t_s", "t_s"), 2.5);
  EXPECT_EQ(in("t_ms", "t_s"), 0.0025);
  EXPECT_EQ(in("Time [µs]", "t_ms"), 0.0025);
  EXPECT_EQ(in("time (s)", "t_ms"), 2500);
  EXPECT_EQ(in("timestamp_ms", "t_s"), 0.0025);
  EXPECT_EQ(in("x/mm", "x_m"), 0.0025);
  EXPECT_EQ(in("X [um]", "x_m"), 2.5e-6);
  EXPECT_EQ(in("angle_deg", "angle_rad", "180"), 3.14159265358979323846);
  EXPECT_EQ(in("Torque [mNm]", "torque_nm"), 0.0025);
  EXPECT_EQ(in("delay_us", "delay_ms"), 0.0025);
}

TEST(TableReader, AColumnThatIsMissingOrThereTwiceIsNamed) {
  const auto error = [](const std::string& header) {
    std::istringstream from(header + "\n1,2\n");
    TableReader table(from, "t.csv");
    return thrown_by<std::runtime_error>([&] { table.column("t_s"); });
  };
  EXPECT_EQ(error("t_s,x"), "");
  EXPECT_EQ(error("t_ms,t_s"), "");
  EXPECT_EQ(error("a,b"), "t.csv:1: expected a header line with a column 't_s', found 'a,b'");
  EXPECT_EQ(error("t_mm,t"), "t.csv:1: expected a header line with a column 't_s', found 't_mm,t'");
  EXPECT_EQ(error("t_s,t_s"), "t.csv:1: expected one column 't_s', found two");
  EXPECT_EQ(error("t_ms,time [us]"), "t.csv:1: expected one column 't_s', found two: 't_ms,time [us]'");
  EXPECT_EQ(error("1,2"), "t.csv:1: expected a header line with a column 't_s', found '1,2'");
}

struct Drawn {
  Rows rows;
  std::string plain;    ///< commas and decimal points
  std::string dressed;  ///< the same numbers in a different format
};

Drawn drawn(std::mt19937_64& random) {
  const auto chance = [&random](std::uint64_t one_in) { return random() % one_in == 0; };
  Drawn result;
  const std::size_t width = 2 + random() % 3;
  const bool comma = chance(2);
  const char separator = comma ? ";\t"[random() % 2] : ",;\t"[random() % 3];
  const std::string end = chance(2) ? "\r\n" : "\n";
  if (chance(2)) result.dressed = "\xef\xbb\xbf";
  const bool header = chance(2);
  const std::size_t lines = 1 + random() % 6 + (header ? 1 : 0);
  for (std::size_t row = 0; row < lines; ++row) {
    const bool names = header && row == 0;
    if (!names) result.rows.emplace_back();
    for (std::size_t i = 0; i < width; ++i) {
      std::string cell = "x" + std::to_string(i) + "_m";
      std::string other = cell;
      if (!names) {
        const bool empty = i > 0 && chance(8);
        const double value = (static_cast<double>(random() % 2'000'001) - 1e6) / (chance(3) ? 1 : 1000);
        std::vector<char> digits(64);
        cell = empty
                   ? ""
                   : std::string(digits.data(), static_cast<std::size_t>(std::snprintf(
                                                    digits.data(), digits.size(), chance(2) ? "%.3f" : "%.9g", value)));
        result.rows.back().push_back(empty ? std::nullopt : std::optional(std::stod(cell)));
        other = cell;
        if (comma) std::ranges::replace(other, '.', ',');
      }
      if (chance(5)) other = '"' + other + '"';
      if (chance(5)) other = ' ' + other + ' ';
      result.plain += (i > 0 ? "," : "") + cell;
      if (i > 0) result.dressed += separator;
      result.dressed += other;
    }
    result.plain += '\n';
    result.dressed += end + (chance(6) ? end : "");
  }
  return result;
}

TEST(TableReader, HoweverATableIsWrittenItHasTheSameNumbersOrIsRefused) {
  std::mt19937_64 random(1);
  int refused = 0;
  for (int i = 0; i < 4000; ++i) {
    const Drawn table = drawn(random);
    ASSERT_EQ(read(table.plain), table.rows) << table.plain;
    try {
      ASSERT_EQ(read(table.dressed), table.rows) << table.dressed;
    } catch (const std::runtime_error& error) {
      ASSERT_NE(std::string_view(error.what()).find("is it "), std::string_view::npos) << error.what() << table.dressed;
      ++refused;
    }
  }
  EXPECT_LT(refused, 1000) << "only where a comma may separate thousands";
}

TEST(TableReader, NoBytesWhateverDoMoreThanAnErrorOfAnExistingLine) {
  std::mt19937_64 random(2);
  constexpr std::string_view kLikely = ",;\t\"\n\r #.-+e0123456789nmx[]\xef\xbb\xbf\xff";
  for (int i = 0; i < 5000; ++i) {
    Drawn table = drawn(random);
    std::string& text = table.dressed;
    for (std::uint64_t changes = 1 + random() % 5; changes > 0; --changes) {
      const std::size_t where = random() % text.size();
      switch (random() % 3) {
        case 0:
          text[where] = kLikely[random() % kLikely.size()];
          break;
        case 1:
          text.insert(where, 1, kLikely[random() % kLikely.size()]);
          break;
        default:
          text.erase(where, 1 + random() % 3);
          break;
      }
      if (text.empty()) text = "\n";
    }
    const auto lines = static_cast<std::size_t>(std::ranges::count(text, '\n')) + 1;
    const bool loose = i % 2 == 0;
    try {
      for (const auto& row : read(text, {.blank_lines_are_cells = loose, .trailing_comments = loose})) {
        for (const auto& number : row) ASSERT_TRUE(!number || std::isfinite(*number)) << text;
      }
    } catch (const std::runtime_error& error) {
      const std::string said = error.what();
      ASSERT_TRUE(said.starts_with("t.csv:")) << said;
      const std::size_t line = std::stoul(said.substr(6));
      ASSERT_GE(line, 1U) << said;
      ASSERT_LE(line, lines) << said << '\n' << text;
    }
  }
}

}  // namespace
}  // namespace tendon::table_reader_test
