// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/tables.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <utility>

#include "protocol/byte_order_mark.h"
#include "server/machine/regular_file.h"
#include "tests/tools/injector/profile/limits.h"
#include "tests/tools/injector/profile/units.h"
#include "tests/tools/injector/profile/words.h"

namespace tendon::injector {

namespace {

std::ifstream open_table(const std::filesystem::path& file, const std::string& expected) {
  std::ifstream in;
  try {
    in = open_regular_file(file);
  } catch (const UnreadableFile& error) {
    throw UnreadableFile(std::string(error.what()) + ", expected " + expected);
  }
  if (in.peek() == std::ifstream::traits_type::eof()) {
    throw std::invalid_argument(file.string() + " is empty, expected " + expected);
  }
  return in;
}

void add(std::vector<Weighted>& to, const TableReader& table, double value_ms, double weight, bool rising) {
  const std::optional<Duration> value = to_duration(value_ms, 1e6);
  if (!value) table.fail("value is " + number_text(value_ms) + "ms, expected 0ms to 60s");
  const Weighted entry{*value, weight};
  if (const auto wrong = complaint(!rising || to.empty() ? nullptr : &to.back(), entry)) table.fail(*wrong);
  if (to.size() == kMaxValues) table.fail("expected at most " + std::to_string(kMaxValues) + " values");
  to.push_back(entry);
}

template <class Read>
std::vector<Weighted> of_a_profile(const Read& read) {
  try {
    return read();
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument(error.what());
  }
}

}  // namespace

void for_each_line(const std::filesystem::path& file, const std::string& expected,
                   const std::function<void(std::string_view, const std::string&)>& take) {
  std::ifstream in = open_table(file, expected);
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    std::string_view line = text;
    if (number == 1) line = without_byte_order_mark(line);
    line = trimmed(line.substr(0, line.find('#')));
    if (!line.empty()) take(line, file.string() + ":" + std::to_string(number) + ": ");
  }
}

std::vector<Weighted> histogram_from_csv(const std::filesystem::path& file) {
  std::ifstream in = open_table(file, "one value in ms and its weight in each line");
  return of_a_profile([&] {
    TableReader table(in, file.string(), {.trailing_comments = true});
    if (table.width() != 2) {
      table.fail("expected LOWER_EDGE_MS,COUNT like 0.56,72, found " + std::to_string(table.width()) +
                 (table.width() == 1 ? " column" : " columns"));
    }
    std::vector<Weighted> bins;
    while (table.next_row()) {
      add(bins, table, table.needed_number(table.column(0, "ms")), table.needed_number({.index = 1}), true);
    }
    return bins;
  });
}

std::vector<Weighted> samples_from_csv(const std::filesystem::path& file) {
  std::ifstream in = open_table(file, "one delay in ms in each line");
  return of_a_profile([&] {
    DelayList delays = open_delays(in, file.string());
    TableReader& table = delays.table;
    std::vector<Weighted> values;
    while (table.next_row()) {
      const auto delay_ms = table.number(delays.delay);
      if (!delay_ms) continue;
      add(values, table, *delay_ms, delays.weight ? table.needed_number(*delays.weight) : 1, false);
    }
    return merged(std::move(values));
  });
}

DelayList open_delays(std::istream& from, const std::string& name) {
  TableReader table(from, name, {.blank_lines_are_cells = true, .trailing_comments = true});
  if (table.width() == 0) throw std::runtime_error(name + ": has no delays");
  if (table.names().empty() && table.width() > 1) {
    const std::string found = std::to_string(table.width()) + " numbers in " + in_quotes(table.first_line());
    table.fail(
        "expected one delay in ms in each line, or a first line with the names of the columns, like "
        "t_ms;delay_ms, found " +
        found + (table.separator() == ',' ? ": are these decimal commas, or are they time and delay?" : ""));
  }
  std::optional<TableReader::Column> delay = table.find("delay_ms");
  if (table.names().empty()) delay = table.column(0, "ms");
  if (!delay) {
    table.fail("expected numbers, or names of columns with delay_ms among them, found " +
               in_quotes(table.first_line()));
  }
  const auto t = table.find("t_ms");
  const auto weight = table.find("weight");
  const bool directed = table.find("dir").has_value();
  const auto dir = directed ? std::optional(table.index_of("dir")) : std::nullopt;
  return {.table = std::move(table), .delay = *delay, .t = t, .weight = weight, .dir = dir};
}

std::vector<Weighted> netem_table(const std::filesystem::path& file, Duration mean, Duration deviation) {
  std::vector<Weighted> values;
  for_each_line(file, "a table of netem", [&](std::string_view line, const std::string& at) {
    while (!line.empty()) {
      const std::string_view word = take_until(line, kBlanks);
      line = trimmed(line);
      const std::optional<double> entry = parse_number(word);
      if (!entry || std::abs(*entry) > 32'768) {
        throw std::invalid_argument(at + "expected whole numbers from -32768 to 32767, got " + in_quotes(word));
      }
      if (values.size() == kMaxValues) throw std::invalid_argument(at + "expected at most 65536 values");
      const auto units = static_cast<std::int64_t>(*entry);
      values.push_back({std::clamp(mean + deviation * units / 8192, Duration::zero(), kMaxDelay), 1});
    }
  });
  return merged(std::move(values));
}

std::vector<Weighted> merged(std::vector<Weighted> values) {
  std::ranges::stable_sort(values, {}, &Weighted::value);
  std::vector<Weighted> result;
  for (const Weighted& entry : values) {
    if (!result.empty() && result.back().value == entry.value) {
      result.back().weight += entry.weight;
    } else {
      result.push_back(entry);
    }
  }
  return result;
}

}  // namespace tendon::injector
