// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/filter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/expect.h"
#include "server/scene/scene.h"
#include "server/tables/table_reader.h"
#include "tests/support/json_line.h"

namespace tendon::lab {
namespace {

struct Format {
  std::string_view header;
  int axes;
  std::string_view applied;
};
constexpr std::array kFormats = {
    Format{"t_s,x_m,wanted_n", 1, "applied_n"},
    Format{"t_s,x_m,y_m,z_m,wanted_x_n,wanted_y_n,wanted_z_n", 3, "applied_x_n,applied_y_n,applied_z_n"},
};

struct Row {
  double t = 0;
  Vec3 position = Vec3::Zero();
  Vec3 wanted = Vec3::Zero();
};

Row row_of(std::span<const double> cells, std::size_t axes) {
  Row row;
  row.t = cells[0];
  for (std::size_t i = 0; i < axes; ++i) {
    row.position[static_cast<Eigen::Index>(i)] = cells[1 + i];
    row.wanted[static_cast<Eigen::Index>(i)] = cells[1 + axes + i];
  }
  return row;
}

/// Joins reasons with "+", because commas separate columns.
std::string reasons_cell(Reasons reasons) {
  std::string text = to_string(reasons);
  for (std::size_t at = text.find(", "); at != std::string::npos; at = text.find(", ")) text.replace(at, 2, "+");
  return text;
}

std::vector<std::string_view> names(std::string_view header) {
  std::vector<std::string_view> result;
  for (;;) {
    const std::size_t comma = header.find(',');
    result.push_back(header.substr(0, comma));
    if (comma == std::string_view::npos) return result;
    header.remove_prefix(comma + 1);
  }
}

/// In the order of the format; empty if the table does not have exactly these columns.
std::vector<TableReader::Column> columns_of(const TableReader& table, const Format& format) {
  std::vector<TableReader::Column> columns;
  for (const std::string_view name : names(format.header)) {
    const auto column = table.find(name);
    if (!column) return {};
    columns.push_back(*column);
  }
  if (columns.size() != table.width()) columns.clear();
  return columns;
}

std::string cell_of(const TableReader& table, const TableReader::Column& column, double value) {
  if (column.multiply != 1 || column.divide != 1) return shortest(value);
  std::string text(table.text(column.index));
  std::ranges::replace(text, ',', '.');
  return text;
}

/// This flushes `out` if it has to wait, because another program can be waiting for the output.
bool next_row(TableReader& table, std::istream& in, std::ostream& out) {
  if (in.rdbuf()->in_avail() <= 0) out.flush();
  return table.next_row();
}

}  // namespace

LimiterConfig limiter_of(const FilterLaw& law) {
  // The motion is recorded, so the device does not matter. A scene's device must have at least the limiter's friction.
  constexpr std::string_view kScene =
      "[device]\nkind = \"simulated\"\n"
      "[device.effects]\nmass_kg = 0.1\nviscous_friction_n_s_per_m = 1e9\ncoulomb_friction_n = 1e9\n"
      "[limiter]\n[force]\nmax_force_n = 8.0\n";
  std::vector<std::string> settings = {
      "limiter.kind=" + law.name, "limiter.coulomb_friction_n=" + shortest(law.coulomb),
      "limiter.viscous_friction_n_s_per_m=" + shortest(law.viscous),
      "loop.period_us=" + shortest(std::min(law.period_us, 1000.0)), "loop.longest_hold_us=" + shortest(law.period_us)};
  settings.insert(settings.end(), law.settings.begin(), law.settings.end());
  return parse_scene(kScene, "the law's scene", ".", settings).loop.control.limiter;
}

int filter(const FilterOptions& options, std::istream& in, std::ostream& out, std::ostream& errors) {
  TableReader table(in, "stdin");
  const Format* format = nullptr;
  std::vector<TableReader::Column> columns;
  for (const Format& known : kFormats) {
    if (format != nullptr) break;
    columns = columns_of(table, known);
    if (!columns.empty()) format = &known;
  }
  if (format == nullptr) {
    table.fail("expected the header " + std::string(kFormats[0].header) + " or " + std::string(kFormats[1].header) +
               ", got \"" + table.first_line() + "\"");
  }
  if (!options.json) out << format->header << "," << format->applied << ",permitted_n,energy_j,reason\n";

  Limiter law(options.limiter);
  std::array<double, 7> storage{};
  const std::span<double> cells(storage.data(), static_cast<std::size_t>(1 + 2 * format->axes));
  const auto inputs = names(format->header);
  const auto outputs = names(format->applied);
  std::optional<Row> before;
  Vec3 applied = Vec3::Zero();
  int bad = 0;
  for (;;) {
    Row row;
    try {
      if (!next_row(table, in, out)) break;
      for (std::size_t i = 0; i < columns.size(); ++i) cells[i] = table.needed_number(columns[i]);
      row = row_of(cells, static_cast<std::size_t>(format->axes));
      if (before && row.t <= before->t) table.fail("time does not increase");
    } catch (const std::runtime_error& wrong) {
      if (in.fail()) throw;  // the rest of the input cannot be read
      errors << wrong.what() << "\n";
      ++bad;
      continue;
    }

    Reasons reasons;
    if (before) {
      const Duration held(std::llround((row.t - before->t) * 1e9));
      // Tolerates 0.5 %, because times in a file are rounded.
      if (seconds(held) > seconds(options.limiter.longest_hold) * 1.005) reasons |= Reason::kOverrun;
      law.observe({.applied = applied, .dx = row.position - before->position, .held = held});
    }
    const double energy = law.energy();
    const LimitedForce<3> limited = law.limit({.force = row.wanted});
    reasons |= limited.reasons;
    applied = limited.force;
    before = row;

    if (options.json) {
      JsonLine json;
      for (std::size_t i = 0; i < inputs.size(); ++i) json.add(inputs[i], cells[i]);
      for (std::size_t i = 0; i < outputs.size(); ++i) json.add(outputs[i], applied[static_cast<Eigen::Index>(i)]);
      json.add("permitted_n", limited.permitted).add("energy_j", energy).add("reason", reasons_cell(reasons));
      out << json.str() << "\n";
    } else {
      for (std::size_t i = 0; i < columns.size(); ++i)
        out << (i > 0 ? "," : "") << cell_of(table, columns[i], cells[i]);
      for (int i = 0; i < format->axes; ++i) out << "," << shortest(applied[i]);
      out << "," << shortest(limited.permitted) << "," << shortest(energy) << "," << reasons_cell(reasons) << "\n";
    }
  }
  if (!out.flush()) throw std::runtime_error("cannot write the result: is the disk full?");
  return bad;
}

}  // namespace tendon::lab
