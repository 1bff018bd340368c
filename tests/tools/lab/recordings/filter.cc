// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/filter.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/expect.h"
#include "server/scene/scene.h"
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

/// Everything between the commas as finite numbers; or what is wrong.
std::optional<std::string> parse(std::string_view line, std::span<double> cells) {
  std::size_t n = 0;
  for (;;) {
    const std::size_t comma = line.find(',');
    const std::string_view cell = line.substr(0, comma);
    if (n < cells.size()) {
      const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), cells[n]);
      if (error != std::errc() || end != cell.data() + cell.size() || !std::isfinite(cells[n]))
        return "cell " + std::to_string(n + 1) + ": expected a finite number, got \"" + std::string(cell) + "\"";
    }
    ++n;
    if (comma == std::string_view::npos) break;
    line.remove_prefix(comma + 1);
  }
  if (n == cells.size()) return std::nullopt;
  return "expected " + std::to_string(cells.size()) + " cells, got " + std::to_string(n);
}

Row row_of(std::span<const double> cells, std::size_t axes) {
  Row row;
  row.t = cells[0];
  for (std::size_t i = 0; i < axes; ++i) {
    row.position[static_cast<Eigen::Index>(i)] = cells[1 + i];
    row.wanted[static_cast<Eigen::Index>(i)] = cells[1 + axes + i];
  }
  return row;
}

/// Commas separate columns: several reasons are joined by a plus.
std::string reasons_cell(Reasons reasons) {
  std::string text = to_string(reasons);
  for (std::size_t at = text.find(", "); at != std::string::npos; at = text.find(", ")) text.replace(at, 2, "+");
  return text;
}

/// "t_s,x_m" and so on, one after the other.
std::vector<std::string_view> names(std::string_view header) {
  std::vector<std::string_view> result;
  for (;;) {
    const std::size_t comma = header.find(',');
    result.push_back(header.substr(0, comma));
    if (comma == std::string_view::npos) return result;
    header.remove_prefix(comma + 1);
  }
}

/// The next line. Before it waits for one, `out` is flushed: someone may be waiting at the other end of the pipe.
bool read_line(std::istream& in, std::ostream& out, std::string& line) {
  if (in.rdbuf()->in_avail() <= 0) out.flush();
  if (!std::getline(in, line)) return false;
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return true;
}

}  // namespace

LimiterConfig limiter_of(const FilterLaw& law) {
  // The motion is recorded, so the device does not matter. A scene's device has at least the limiter's friction.
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
  std::string line;
  const Format* format = nullptr;
  if (read_line(in, out, line)) {
    for (const Format& known : kFormats) {
      if (line == known.header) format = &known;
    }
  }
  if (format == nullptr) {
    throw std::runtime_error("line 1: expected the header " + std::string(kFormats[0].header) + " or " +
                             std::string(kFormats[1].header) + ", got \"" + line + "\"");
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
  for (std::size_t number_of_line = 2; read_line(in, out, line); ++number_of_line) {
    auto wrong = parse(line, cells);
    const Row row = row_of(cells, static_cast<std::size_t>(format->axes));
    if (!wrong && before && row.t <= before->t) wrong = "time does not go on";
    if (wrong) {
      errors << "line " << number_of_line << ": " << *wrong << "\n";
      ++bad;
      continue;
    }

    Reasons reasons;
    if (before) {
      const Duration held(std::llround((row.t - before->t) * 1e9));
      // Times in a file are rounded: half a per cent is no overrun.
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
      out << line;
      for (int i = 0; i < format->axes; ++i) out << "," << shortest(applied[i]);
      out << "," << shortest(limited.permitted) << "," << shortest(energy) << "," << reasons_cell(reasons) << "\n";
    }
  }
  if (!out.flush()) throw std::runtime_error("cannot write the result: is the disk full?");
  return bad;
}

}  // namespace tendon::lab
