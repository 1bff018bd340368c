// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/grid/grid.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <fstream>
#include <functional>
#include <iostream>
#include <iterator>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>
#include <utility>

#include "clients/cpp/force_client.h"
#include "core/base/expect.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/meter.h"
#include "tests/tools/lab/grid/ranges.h"
#include "tests/tools/lab/grid/zwidth.h"

namespace tendon::lab {
namespace {

using Results = std::map<std::uint64_t, Measured>;

std::vector<JsonLine> lines_of(const Measured& measured) {
  std::vector<JsonLine> lines(1);
  lines.front()
      .add("round_trip_s", measured.round_trip)
      .add("loss", measured.loss)
      .add("felt_n_per_m", measured.felt_stiffness)
      .add("least_energy_j", measured.least_energy)
      .add("vibration_mps", measured.vibration)
      .add("felt_db", measured.felt_db)
      .add("force_error_n", measured.force_error)
      .add("limited", measured.limited_share);
  return lines;
}

Measured measured_in(const nlohmann::json& line) {
  const auto number = [&line](const char* key) -> std::optional<double> {
    const nlohmann::json& value = line.at(key);
    if (value.is_null()) return std::nullopt;
    return value.get<double>();
  };
  return {.round_trip = number("round_trip_s"),
          .loss = number("loss"),
          .felt_stiffness = number("felt_n_per_m"),
          .least_energy = number("least_energy_j"),
          .vibration = number("vibration_mps"),
          .felt_db = number("felt_db"),
          .force_error = number("force_error_n"),
          .limited_share = number("limited")};
}

/// The finished cells of a sweep, which is kept if it is interrupted.
class Journal {
 public:
  /// Throws std::invalid_argument if the file belongs to another sweep, and std::runtime_error if it cannot be written.
  Journal(std::filesystem::path file, const Origin& origin, std::uint64_t cells, Results& finished)
      : file_(std::move(file)) {
    const std::string heading = JsonLine()
                                    .add("command", origin.command)
                                    .add("scene_sha256", origin.scene_sha256)
                                    .add("commit", origin.commit)
                                    .add("arithmetic", origin.arithmetic)
                                    .str();
    std::uintmax_t whole = 0;
    if (std::ifstream in(file_); in) whole = read(in, heading, cells, finished);
    // An interruption can cut the last line off.
    if (std::filesystem::exists(file_)) std::filesystem::resize_file(file_, whole);
    out_.open(file_, std::ios::app);
    if (whole == 0) out_ << heading << '\n' << std::flush;
    if (!out_) {
      throw std::runtime_error("cannot write " + file_.string() +
                               ": expected space, and a folder with write permission");
    }
  }

  void add(std::uint64_t unit, const Measured& measured) {
    out_ << JsonLine().add("unit", unit).add_all(lines_of(measured).front()).str() << '\n' << std::flush;
    if (!out_) {
      throw std::runtime_error("cannot write " + file_.string() +
                               ": is the disk full? The finished cells are kept; the same command continues");
    }
  }

  void remove() {
    out_.close();
    std::filesystem::remove(file_);
  }

 private:
  /// Returns the number of bytes of the whole lines.
  std::uintmax_t read(std::ifstream& in, const std::string& heading, std::uint64_t cells, Results& finished) const {
    std::string line;
    if (!std::getline(in, line) || in.eof()) return 0;
    if (line != heading) {
      throw std::invalid_argument(file_.string() + " belongs to another sweep: expected " + heading + ", found " +
                                  line + "; remove it, or use another --out");
    }
    std::uintmax_t whole = line.size() + 1;
    while (std::getline(in, line) && !in.eof()) {
      const nlohmann::json cell = nlohmann::json::parse(line, nullptr, false);
      try {
        const std::uint64_t unit = cell.at("unit").get<std::uint64_t>();
        if (unit >= cells) throw std::invalid_argument("expected a unit below " + std::to_string(cells));
        finished[unit] = measured_in(cell);
      } catch (const std::exception& error) {
        throw std::invalid_argument(file_.string() + ": " + error.what() + ", in " + line +
                                    "; remove it to start again");
      }
      whole += line.size() + 1;
    }
    return whole;
  }

  std::filesystem::path file_;
  std::ofstream out_;
};

/// Runs the units on several threads. `each` is called for each result, by one thread at a time.
void run_units(const std::vector<std::uint64_t>& units, unsigned jobs,
               const std::function<Measured(std::uint64_t)>& run,
               const std::function<void(std::uint64_t, const Measured&)>& each) {
  std::mutex lock;
  std::size_t next = 0;
  std::exception_ptr failure;
  const auto work = [&] {
    while (true) {
      std::uint64_t unit = 0;
      {
        const std::scoped_lock guard(lock);
        if (failure || next == units.size()) return;
        unit = units[next++];
      }
      try {
        const Measured measured = run(unit);
        const std::scoped_lock guard(lock);
        if (!failure) each(unit, measured);
      } catch (...) {
        const std::scoped_lock guard(lock);
        failure = std::current_exception();
      }
    }
  };
  std::vector<std::thread> threads;
  for (unsigned i = 1; i < jobs; ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (failure) std::rethrow_exception(failure);
}

std::string time_in_words(double s) {
  return s < 100 ? std::to_string(static_cast<int>(s + 1)) + " s"
                 : std::to_string(static_cast<int>(s / 60 + 1)) + " min";
}

/// Throws std::invalid_argument if the file is not the table of this command.
void expect_own_table(const std::filesystem::path& file, const std::string& command) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line) || line == "# " + command) return;
  throw std::invalid_argument(file.string() + " is not the table of this command, but begins with \"" + line +
                              "\"; use another --out");
}

/// Puts the name of the option before an error of `make`.
template <class Make>
auto named(std::string_view option, const Make& make) {
  try {
    return make();
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(option) + ": " + error.what());
  }
}

}  // namespace

std::vector<GridCell> cells_of(const GridOptions& options) {
  const auto laws = named("--law", [&] { return separated(options.laws); });
  const auto networks = named("--network", [&] {
    std::vector<std::string> all;
    for (const std::string& one : separated(options.networks)) {
      const auto each = one.starts_with("trace:") ? std::vector{one} : expanded(one);
      all.insert(all.end(), each.begin(), each.end());
    }
    return all;
  });
  constexpr double kMostStiffness = 1e6;
  const auto walls = numbers(options.stiffness, "--stiffness", 1, kMostStiffness);
  const auto rates = numbers(options.rates, "--rate-hz", ForceClient::kMinRateHz, ForceClient::kMaxRateHz);
  if (options.seeds == 0) throw std::invalid_argument("--seeds: expected at least 1");
  const double all = static_cast<double>(laws.size() * networks.size() * walls.size() * rates.size()) *
                     static_cast<double>(options.seeds);
  if (all > kMostCells) {
    throw std::invalid_argument("expected at most " + std::to_string(kMostCells) + " cells, found " + shortest(all));
  }
  std::vector<GridCell> cells;
  for (const std::string& law : laws) {
    for (const std::string& network : networks) {
      for (const double rate : rates) {
        for (const double wall : walls) {
          for (std::uint64_t seed = 0; seed < options.seeds; ++seed) {
            cells.push_back({law, network, wall, rate, options.first_seed + seed});
          }
        }
      }
    }
  }
  return cells;
}

std::string command_of(const GridOptions& options) {
  std::string command = "tendon-lab sweep " + options.scene.string() + " --network '" + options.networks +
                        "' --stiffness " + options.stiffness + " --law " + options.laws + " --rate-hz " +
                        options.rates + " --seeds " + std::to_string(options.seeds);
  if (options.first_seed != 1) command += " --first-seed " + std::to_string(options.first_seed);
  if (options.length_s) command += " --for-s " + shortest(*options.length_s);
  command += " --quiet-mps " + shortest(options.thresholds.vibration) + " --passive-j " +
             shortest(options.thresholds.given_out);
  if (options.zwidth) command += " --plot zwidth";
  return command;
}

void run_grid(const GridOptions& options, std::ostream& out) {
  const std::vector<GridCell> cells = cells_of(options);
  if (options.length_s && !(*options.length_s > 1)) throw std::invalid_argument("--for-s: expected more than 1 s");
  GridBench bench(options.scene);
  std::map<std::string, std::string> parts;
  for (const GridCell& cell : cells) {
    if (!parts.contains(cell.law)) parts[cell.law] = bench.parts_of(cell.law);
    named("--network", [&] { bench.add_network(cell.network); });
  }
  const auto length_of = [&](const GridCell& cell) {
    if (options.length_s) return from_seconds(*options.length_s);
    return bench.length_of(cell.network).value_or(kDefaultLength);
  };
  const auto run = [&](std::uint64_t unit) { return bench.run(cells[unit], length_of(cells[unit])); };
  const Origin origin = origin_of(command_of(options), bench.scene().text);

  if (options.dry_run) {
    const Meter meter;
    const Meter::Reading before = meter.read();
    run(0);
    const double all = (meter.read() - before).wall * static_cast<double>(cells.size()) / options.jobs;
    out << cells.size() << (cells.size() == 1 ? " cell of " : " cells of ")
        << shortest(seconds(length_of(cells.front()))) << " s; about " << time_in_words(all) << " with --jobs "
        << options.jobs << '\n';
    return;
  }

  Results results;
  std::optional<Journal> journal;
  if (!options.out.empty() && !options.part.units) {
    std::filesystem::create_directories(options.out);
    expect_own_table(options.out / "cells.csv", origin.command);
    if (!options.part.from) journal.emplace(options.out / "cells.partial", origin, cells.size(), results);
  }
  if (!options.part.from) {
    const Units all = options.part.units.value_or(Units{0, cells.size()});
    std::vector<std::uint64_t> missing;
    for (std::uint64_t i = 0; i < all.count && all.first + i < cells.size(); ++i) {
      if (!results.contains(all.first + i)) missing.push_back(all.first + i);
    }
    if (!results.empty()) out << "continuing: " << results.size() << " of " << cells.size() << " cells have finished\n";
    const Meter meter;
    const Meter::Reading before = meter.read();
    std::size_t done = 0;
    run_units(missing, options.jobs, run, [&](std::uint64_t unit, const Measured& measured) {
      results[unit] = measured;
      if (journal) journal->add(unit, measured);
      ++done;
      if (!options.part.progress) return;
      const double left =
          (meter.read() - before).wall * static_cast<double>(missing.size() - done) / static_cast<double>(done);
      std::cerr << "\r\x1b[K" << done << " of " << missing.size() << " cells";
      if (done < missing.size()) std::cerr << ", about " << time_in_words(left) << " left";
      std::cerr << std::flush;
    });
    if (options.part.progress) std::cerr << "\r\x1b[K" << std::flush;
  }

  SweptWork<Measured> work{
      .what = "cells",
      .units = cells.size(),
      .run = [&results](std::uint64_t unit) { return results.at(unit); },
      .lines = [](std::uint64_t /*unit*/, const Measured& measured) { return lines_of(measured); },
      .read = [](std::uint64_t /*unit*/, const std::vector<nlohmann::json>& lines) { return measured_in(lines.at(0)); },
      .count =
          [&options](const Measured& measured, ShardEnd& end) {
            end.count("cells", 1);
            end.count("quiet", quiet(measured, options.thresholds).value_or(false) ? 1 : 0);
            end.count("passive", passive(measured, options.thresholds).value_or(false) ? 1 : 0);
          }};
  Part part = options.part;
  part.progress = false;
  const auto all = outcomes(work, part, out);
  if (!all) return;
  std::vector<GridRow> rows;
  for (std::size_t i = 0; i < cells.size(); ++i) rows.push_back({cells[i], (*all)[i]});
  const CsvTable table = table_of(rows, options.thresholds, origin, parts);
  if (options.json) {
    for (const auto& [cell, measured] : rows) {
      out << JsonLine()
                 .add("law", cell.law)
                 .add("network", cell.network)
                 .add("stiffness_n_per_m", cell.stiffness)
                 .add("rate_hz", cell.rate_hz)
                 .add("seed", cell.seed)
                 .add_all(lines_of(measured).front())
                 .add("commit", origin.commit)
                 .str()
          << '\n';
    }
  } else if (options.out.empty()) {
    out << table.str();
  } else {
    table.write(options.out / "cells.csv");
    out << "table: " << (options.out / "cells.csv").string() << '\n';
    if (options.zwidth) {
      for (const auto& file : draw_zwidth(options.out / "zwidth", rows, options.thresholds, origin)) {
        out << "picture: " << file.string() << '\n';
      }
    }
    if (journal) journal->remove();
  }
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace tendon::lab
