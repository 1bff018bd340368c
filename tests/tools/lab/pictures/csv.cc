// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/csv.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "core/base/expect.h"
#include "tests/support/files.h"

namespace tendon::lab {
namespace {

std::string quoted_if_needed(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? "\"\"" : std::string(1, c);
  return result + '"';
}

std::string csv_field(const nlohmann::ordered_json& value) {
  constexpr int kDigits = 6;
  if (value.is_null()) return "";
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) return rounded(value.get<double>(), kDigits);
  if (value.is_number()) return value.dump();
  if (value.is_string()) return quoted_if_needed(value.get<std::string>());
  throw std::logic_error("a CSV field cannot contain " + value.dump());
}

}  // namespace

void CsvTable::add(const JsonLine& row) {
  const auto values = nlohmann::ordered_json::parse(row.str());
  for (const auto& [key, value] : values.items()) {
    if (std::ranges::find(columns_, key) == columns_.end()) columns_.push_back(key);
  }
  std::string text;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (i > 0) text += ',';
    if (const auto found = values.find(columns_[i]); found != values.end()) text += csv_field(*found);
  }
  rows_.emplace_back(std::move(text), columns_.size());
}

std::string CsvTable::str() const {
  std::string text = command_.empty() ? "" : "# " + command_ + '\n';
  for (std::size_t i = 0; i < columns_.size(); ++i) text += (i > 0 ? "," : "") + columns_[i];
  text += '\n';
  for (const auto& [row, fields] : rows_) text += row + std::string(columns_.size() - fields, ',') + '\n';
  return text;
}

void CsvTable::write(const std::filesystem::path& file) const {
  expect_replaceable(file, {"# tendon-lab "});
  std::filesystem::path replacement = file;
  replacement += ".new";
  std::ofstream out(replacement, std::ios::binary);
  out << str();
  out.close();
  if (!out) {
    std::error_code ignored;
    std::filesystem::remove(replacement, ignored);
    throw std::runtime_error("cannot write " + file.string() + ": expected space, and a folder with write permission");
  }
  std::filesystem::rename(replacement, file);
}

}  // namespace tendon::lab
