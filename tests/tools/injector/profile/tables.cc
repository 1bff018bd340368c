// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/tables.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <utility>

#include "server/machine/regular_file.h"
#include "tests/tools/injector/profile/limits.h"
#include "tests/tools/injector/profile/units.h"
#include "tests/tools/injector/profile/words.h"

namespace tendon::injector {

void for_each_line(const std::filesystem::path& file, const std::string& expected,
                   const std::function<void(std::string_view, const std::string&)>& take) {
  std::ifstream in;
  try {
    in = open_regular_file(file);
  } catch (const std::runtime_error& error) {
    throw std::invalid_argument(std::string(error.what()) + ", expected " + expected);
  }
  if (in.peek() == std::ifstream::traits_type::eof()) {
    throw std::invalid_argument(file.string() + " is empty, expected " + expected);
  }
  std::string text;
  for (int number = 1; std::getline(in, text); ++number) {
    const std::string_view line = trimmed(std::string_view(text).substr(0, text.find('#')));
    if (!line.empty()) take(line, file.string() + ":" + std::to_string(number) + ": ");
  }
}

std::vector<Weighted> table_from_csv(const std::filesystem::path& file, bool weightless) {
  std::vector<Weighted> table;
  for_each_line(file, "one value in ms and its weight in each line", [&](std::string_view line, const std::string& at) {
    std::string_view rest = line;
    const std::optional<double> value_ms = parse_number(take_until(rest, ",; \t"));
    rest = trimmed(rest);
    if (rest.starts_with(',') || rest.starts_with(';')) rest = trimmed(rest.substr(1));
    const std::optional<double> weight = weightless && rest.empty() ? 1.0 : parse_number(rest);
    if (!value_ms || !weight) {
      throw std::invalid_argument(at + "expected " +
                                  (weightless ? "VALUE_MS or VALUE_MS,COUNT" : "LOWER_EDGE_MS,COUNT") +
                                  " like 0.56,72, got " + in_quotes(line));
    }
    const std::optional<Duration> value = to_duration(*value_ms, 1e6);
    if (!value) throw std::invalid_argument(at + "value is " + number_text(*value_ms) + "ms, expected 0ms to 60s");
    const Weighted entry{*value, *weight};
    // Samples come in any order.
    if (const auto wrong = complaint(weightless || table.empty() ? nullptr : &table.back(), entry)) {
      throw std::invalid_argument(at + *wrong);
    }
    if (table.size() == kMaxValues)
      throw std::invalid_argument(at + "expected at most " + std::to_string(kMaxValues) + " values");
    table.push_back(entry);
  });
  return table;
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
