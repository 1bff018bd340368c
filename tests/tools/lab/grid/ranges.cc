// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/grid/ranges.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <stdexcept>

#include "core/base/expect.h"

namespace tendon::lab {
namespace {

struct Number {
  double value = 0;
  int decimals = 0;
  std::size_t length = 0;  ///< characters
};

/// Returns the decimal number at the start of `text`, without an exponent.
std::optional<Number> number_at(std::string_view text) {
  std::size_t end = !text.empty() && text.front() == '-' ? 1 : 0;
  const std::size_t digits = end;
  while (end < text.size() && text[end] >= '0' && text[end] <= '9') ++end;
  if (end == digits) return std::nullopt;
  Number number;
  if (end < text.size() && text[end] == '.') {
    const std::size_t point = end++;
    while (end < text.size() && text[end] >= '0' && text[end] <= '9') ++end;
    number.decimals = static_cast<int>(end - point - 1);
  }
  std::from_chars(text.data(), text.data() + end, number.value, std::chars_format::fixed);
  number.length = end;
  return number;
}

struct Choice {
  std::vector<std::string> values;
  std::size_t length = 0;  ///< characters in the text
};

std::string fixed(double value, int decimals) {
  std::array<char, 64> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed, decimals);
  return {text.data(), end.ptr};
}

/// Without an exponent, as in a command line.
std::string plain(double value) { return value < 1 ? shortest(value) : fixed(value, 0); }

std::optional<Choice> range_at(std::string_view text) {
  std::array<Number, 3> parts;
  std::size_t at = 0;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (i > 0 && (at >= text.size() || text[at++] != ':')) return std::nullopt;
    const auto number = number_at(text.substr(at));
    if (!number) return std::nullopt;
    parts.at(i) = *number;
    at += number->length;
  }
  const auto& [first, last, step] = parts;
  const double steps = (last.value - first.value) / step.value;
  constexpr double kRounding = 1e-6;
  if (!(steps >= 0) || std::abs(steps - std::round(steps)) > kRounding || steps > kMostValues) {
    throw std::invalid_argument("expected a range A:B:STEP that reaches B in whole steps, found " +
                                std::string(text.substr(0, at)));
  }
  const int decimals = std::max(first.decimals, step.decimals);
  Choice choice{.values = {}, .length = at};
  for (int i = 0; i <= std::lround(steps); ++i) choice.values.push_back(fixed(first.value + i * step.value, decimals));
  return choice;
}

std::optional<Choice> list_at(std::string_view text) {
  if (text.front() != '{') return std::nullopt;
  const std::size_t end = text.find('}');
  if (end == std::string_view::npos) throw std::invalid_argument("expected } at the end of " + std::string(text));
  Choice choice{.values = {}, .length = end + 1};
  for (const std::string& value : separated(text.substr(1, end - 1))) {
    for (std::string& each : expanded(value)) choice.values.push_back(std::move(each));
  }
  return choice;
}

}  // namespace

std::vector<std::string> separated(std::string_view text) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : text) {
    if (c == '(' || c == '{') ++depth;
    if (c == ')' || c == '}') --depth;
    if (c == ',' && depth == 0) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  if (std::ranges::any_of(parts, &std::string::empty)) {
    throw std::invalid_argument("expected a value on both sides of each comma, found \"" + std::string(text) + '"');
  }
  return parts;
}

std::vector<std::string> expanded(std::string_view text) {
  std::vector<std::string> texts(1);
  const auto append = [&texts](const std::vector<std::string>& values) {
    if (texts.size() * values.size() > kMostValues) {
      throw std::invalid_argument("expected at most " + std::to_string(kMostValues) + " combinations, found more");
    }
    std::vector<std::string> product;
    for (const std::string& one : texts) {
      for (const std::string& value : values) product.push_back(one + value);
    }
    texts = std::move(product);
  };
  const auto continues_number = [&text](std::size_t at) {
    const char before = at > 0 ? text[at - 1] : ' ';
    return before == '.' || before == ':' || (before >= '0' && before <= '9') || before == '-';
  };
  for (std::size_t at = 0; at < text.size();) {
    auto choice = list_at(text.substr(at));
    if (!choice && !continues_number(at)) choice = range_at(text.substr(at));
    if (choice) {
      append(choice->values);
      at += choice->length;
    } else {
      append({std::string(1, text[at++])});
    }
  }
  return texts;
}

std::vector<double> numbers(std::string_view text, std::string_view option, double least, double most) {
  const std::string name(option);
  std::vector<double> all;
  try {
    for (const std::string& part : separated(text)) {
      for (const std::string& one : expanded(part)) {
        const auto number = number_at(one);
        if (!number || number->length != one.size() || !(number->value >= least && number->value <= most)) {
          throw std::invalid_argument("expected numbers from " + plain(least) + " to " + plain(most) +
                                      " or a range A:B:STEP, found \"" + one + '"');
        }
        if (std::ranges::find(all, number->value) != all.end()) {
          throw std::invalid_argument("expected each number once, found " + one + " twice");
        }
        all.push_back(number->value);
      }
    }
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(name + ": " + error.what());
  }
  return all;
}

}  // namespace tendon::lab
