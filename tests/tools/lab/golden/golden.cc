// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/golden/golden.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <map>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "core/base/expect.h"
#include "server/machine/regular_file.h"
#include "tests/support/files.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/compare.h"
#include "tests/tools/lab/experiments/experiment.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/lab/golden/law_cost.h"

namespace tendon::lab {
namespace {

constexpr std::size_t kEvery = 209;
constexpr std::uint64_t kFirstSeed = 1;
constexpr std::array kPaperLaws = {Law::kNone, Law::kAol, Law::kAolPlus};

struct Figure {
  const char* name;
  double Outcome::*value;
};
constexpr std::array kFigures = {
    Figure{"least_energy_j", &Outcome::least_energy},   Figure{"k_op_n_per_m", &Outcome::operational_stiffness},
    Figure{"force_error_n", &Outcome::force_error},     Figure{"true_force_n", &Outcome::true_force},
    Figure{"largest_force_n", &Outcome::largest_force}, Figure{"late_vibration_m_per_s", &Outcome::late_vibration},
    Figure{"limited_share", &Outcome::limited_share},   Figure{"latency_s", &Outcome::latency}};

GoldenTable::Row row_of(std::string_view law, std::string situation, const Outcome& outcome) {
  GoldenTable::Row row{.law = std::string(law), .situation = std::move(situation), .figures = {}};
  for (const Figure& figure : kFigures) row.figures.push_back(shortest(outcome.*figure.value));
  return row;
}

std::string name_of(const Situation& s) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), "%g N/m %g+%g ms %g Hz loss %g b %g fc %g %s hand", s.stiffness, s.delay_ms,
                s.jitter_ms, s.rate_hz, s.loss, s.friction.viscous, s.friction.coulomb, s.firm ? "firm" : "loose");
  return text.data();
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  if (line.ends_with(',')) cells.emplace_back();
  return cells;
}

using Key = std::pair<std::string, std::string>;
using Figures = std::map<std::string, std::string>;

std::map<Key, Figures> by_key(const GoldenTable& table) {
  std::map<Key, Figures> all;
  for (const GoldenTable::Row& row : table.rows) {
    Figures& figures = all[{row.law, row.situation}];
    for (std::size_t i = 0; i < table.columns.size(); ++i) figures[table.columns[i]] = row.figures[i];
  }
  return all;
}

}  // namespace

GoldenTable golden_laws() {
  GoldenTable table;
  for (const Figure& figure : kFigures) table.columns.emplace_back(figure.name);
  const std::vector<Situation> grid = comparison_grid();
  for (const LawInfo& law : laws()) {
    for (std::size_t i = 0; i < grid.size(); i += kEvery) {
      table.rows.push_back(row_of(law.name, name_of(grid[i]), compare_cell(grid[i], law.law, kFirstSeed + i).outcome));
    }
  }
  for (const PresetInfo& preset : presets()) {
    for (std::size_t i = 0; i < grid.size(); i += kEvery) {
      table.rows.push_back(
          row_of(preset.name, name_of(grid[i]), compare_cell(grid[i], preset.preset, kFirstSeed + i).outcome));
    }
  }
  for (const PaperExperiment& experiment : paper_experiments()) {
    for (const Law law : kPaperLaws) {
      const PaperRow row = paper_row(experiment, law);
      table.rows.push_back(row_of(info(law).name, "paper " + experiment.name + " prescribed motion", row.prescribed));
      table.rows.push_back(row_of(info(law).name, "paper " + experiment.name + " free hand", row.free));
    }
  }
  return table;
}

void write(std::ostream& out, const GoldenTable& table) {
  out << "law,situation";
  for (const std::string& column : table.columns) out << "," << column;
  out << "\n";
  for (const GoldenTable::Row& row : table.rows) {
    out << row.law << "," << row.situation;
    for (const std::string& figure : row.figures) out << "," << figure;
    out << "\n";
  }
}

GoldenTable read_golden(const std::filesystem::path& file) {
  std::ifstream in = open_regular_file(file, "golden table");
  std::string line;
  if (!std::getline(in, line) || !line.starts_with("law,situation,")) {
    throw std::runtime_error(file.string() + ": expected a table that starts with law,situation,");
  }
  GoldenTable table;
  table.columns = cells_of(line);
  table.columns.erase(table.columns.begin(), table.columns.begin() + 2);
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    std::vector<std::string> cells = cells_of(line);
    if (cells.size() != table.columns.size() + 2) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": expected " +
                               std::to_string(table.columns.size() + 2) + " cells, got " +
                               std::to_string(cells.size()));
    }
    table.rows.push_back({cells[0], cells[1], {cells.begin() + 2, cells.end()}});
  }
  return table;
}

std::vector<GoldenDifference> differences(const GoldenTable& was, const GoldenTable& is) {
  std::vector<GoldenDifference> found;
  const auto before = by_key(was);
  const auto now = by_key(is);
  const auto look = [&](const GoldenTable::Row& row, const std::string& figure) {
    const Key key{row.law, row.situation};
    const auto text = [&](const std::map<Key, Figures>& table) {
      const auto figures = table.find(key);
      if (figures == table.end()) return std::string();
      const auto one = figures->second.find(figure);
      return one == figures->second.end() ? std::string() : one->second;
    };
    const GoldenDifference one{row.law, row.situation, figure, text(before), text(now)};
    if (one.was != one.is) found.push_back(one);
  };
  for (const GoldenTable::Row& row : is.rows) {
    for (const std::string& figure : is.columns) look(row, figure);
  }
  for (const GoldenTable::Row& row : was.rows) {  // removed rows and columns
    const bool row_is_gone = !now.contains({row.law, row.situation});
    for (const std::string& figure : was.columns) {
      if (row_is_gone || std::ranges::find(is.columns, figure) == is.columns.end()) look(row, figure);
    }
  }
  return found;
}

std::string to_text(const std::vector<GoldenDifference>& differences) {
  const GoldenDifference heading{"law", "situation", "figure", "was", "is"};
  GoldenDifference widest = heading;
  const auto widen = [](std::string& width, const std::string& text) {
    if (text.size() > width.size()) width = text;
  };
  for (const GoldenDifference& one : differences) {
    widen(widest.law, one.law);
    widen(widest.situation, one.situation);
    widen(widest.figure, one.figure);
    widen(widest.was, one.was);
  }
  const auto padded = [](const std::string& text, const std::string& width) {
    return text + std::string(width.size() - text.size() + 2, ' ');
  };
  std::string text;
  const auto add = [&](const GoldenDifference& one) {
    text += padded(one.law, widest.law) + padded(one.situation, widest.situation) + padded(one.figure, widest.figure) +
            padded(one.was, widest.was) + one.is + "\n";
  };
  add(heading);
  for (const GoldenDifference& one : differences) add(one);
  return text;
}

namespace {

/// Replaces `file`, which must not exist or begin with `beginning`.
template <class Table>
void replace(const std::filesystem::path& file, std::string_view beginning, const Table& table, std::ostream& out) {
  expect_replaceable(file, {beginning});
  std::ofstream stream(file);
  write(stream, table);
  stream.close();
  if (!stream) throw std::runtime_error("cannot write " + file.string());
  out << "written: " << file.string() << "\n";
}

bool golden_costs(const GoldenOptions& options, std::ostream& out) {
  const std::filesystem::path file = options.folder / "cost.csv";
  if (options.write) {
    replace(file, "# counted with ", count_law_costs(options.law_cost), out);
    return true;
  }
  const CostTable was = read_costs(file);
  if (const std::string why = why_not_comparable(was, {.built_with = built_with(), .rows = {}}); !why.empty()) {
    throw std::runtime_error(file.string() + ": " + why);
  }
  const CostTable is = count_law_costs(options.law_cost);
  const std::string found = cost_differences(was, is);
  if (found.empty()) {
    out << is.rows.size() << " laws have the costs in " << file.string() << ", within 2 %\n";
  } else {
    out << found;
  }
  return found.empty();
}

}  // namespace

bool golden(const GoldenOptions& options, std::ostream& out) {
  if (options.cost) return golden_costs(options, out);
  const std::filesystem::path file = options.folder / "laws.csv";
  const GoldenTable is = golden_laws();
  if (!options.write) {
    const auto found = differences(read_golden(file), is);
    if (found.empty()) {
      out << is.rows.size() << " rows of " << file.string() << " are identical\n";
    } else {
      out << to_text(found) << found.size() << " values differ from " << file.string() << "\n";
    }
    return found.empty();
  }
  replace(file, "law,situation,", is, out);
  return true;
}

}  // namespace tendon::lab
