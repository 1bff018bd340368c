// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <tuple>

#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/floor.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/lab/experiments/perception.h"
#include "tests/tools/lab/pictures/csv.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

struct TestDevice {
  const char* name;
  Friction friction;
};
constexpr std::array kDevices = {TestDevice{"0.26 N s/m", {.coulomb = 0.02, .viscous = 0.26}},
                                 TestDevice{"0.05 N s/m", {.coulomb = 0.04, .viscous = 0.05}},
                                 TestDevice{"0.005 N s/m", {.coulomb = 0.04, .viscous = 0.005}}};
constexpr std::array kStiffnesses = {100.0, 300.0, 500.0, 1000.0, 2000.0, 8000.0};  // N/m
constexpr Duration kLength = std::chrono::seconds(2);

Trial trial_of(const Situation& situation, std::uint64_t seed);

std::string text(const char* format, double value) {
  std::array<char, 64> buffer{};
  std::snprintf(buffer.data(), buffer.size(), format, value);
  return buffer.data();
}

double relative_error(const Cell& cell) {
  return cell.outcome.true_force > 0 ? cell.outcome.force_error / cell.outcome.true_force : 0;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

JsonLine json_of(const Cell& cell, std::uint64_t seed) {
  const Situation& s = cell.situation;
  const Outcome& o = cell.outcome;
  JsonLine line;
  line.add("law", cell.name())
      .add("stiffness_n_per_m", s.stiffness)
      .add("delay_ms", s.delay_ms)
      .add("jitter_ms", s.jitter_ms)
      .add("rate_hz", s.rate_hz)
      .add("loss", s.loss)
      .add("b_n_s_per_m", s.friction.viscous)
      .add("fc_n", s.friction.coulomb)
      .add("hand", s.firm ? "firm" : "loose")
      .add("passive", cell.passive())
      .add("energy_given_out_j", std::max(0.0, -o.least_energy))
      .add("least_energy_j", o.least_energy)
      .add("k_op_n_per_m", o.operational_stiffness)
      .add("force_error_n", o.force_error)
      .add("true_force_n", o.true_force)
      .add("hf_velocity_m_s", o.late_vibration)
      .add("sensation_db", o.sensation)
      .add("noticed_share", o.noticed_share)
      .add("stiffness_noticed", notices_stiffness(o.operational_stiffness, s.stiffness))
      .add("limited_share", o.limited_share)
      .add("latency_s", o.latency)
      .add("max_force_n", o.largest_force)
      .add("seed", seed)
      .add("commit", kCommit);
  return line;
}

struct Summary {
  Contender contender;
  std::size_t cells = 0;
  double passive = 0;    ///< share
  double stable = 0;     ///< share
  double error = 0;      ///< median of the relative force error
  double vibration = 0;  ///< m/s, median
  double sensation = 0;  ///< dB above what a hand just feels, median
  double noticed = 0;    ///< fraction of the time, median
  double given_out = 0;  ///< J, maximum
  double limited = 0;    ///< median share
  double latency = 0;    ///< s, median
};

std::vector<Summary> summaries(const std::vector<Cell>& cells, const std::function<bool(const Situation&)>& where) {
  std::vector<Summary> result;
  for (const Contender& contender : contenders()) {
    Summary summary{.contender = contender};
    std::vector<double> errors;
    std::vector<double> vibrations;
    std::vector<double> sensations;
    std::vector<double> noticed;
    std::vector<double> limited;
    std::vector<double> latencies;
    for (const Cell& cell : cells) {
      if (cell.name() != contender.name || !where(cell.situation)) continue;
      summary.passive += cell.passive() ? 1 : 0;
      summary.stable += cell.outcome.stable ? 1 : 0;
      summary.given_out = std::max(summary.given_out, -cell.outcome.least_energy);
      errors.push_back(relative_error(cell));
      vibrations.push_back(cell.outcome.late_vibration);
      sensations.push_back(cell.outcome.sensation);
      noticed.push_back(cell.outcome.noticed_share);
      limited.push_back(cell.outcome.limited_share);
      latencies.push_back(cell.outcome.latency);
    }
    summary.cells = errors.size();
    if (errors.empty()) continue;
    const auto n = static_cast<double>(errors.size());
    summary.passive /= n;
    summary.stable /= n;
    summary.error = median(errors);
    summary.vibration = median(vibrations);
    summary.sensation = median(sensations);
    summary.noticed = median(noticed);
    summary.limited = median(limited);
    summary.latency = median(latencies);
    result.push_back(summary);
  }
  return result;
}

/// The constraint that the law guarantees on this device, or else the weakest one.
Passive sense_of(const Contender& contender, const Friction& friction) {
  if (!contender.promises) return Passive::kOnThisMotion;
  if (contender.law != Law::kAolPlus) return Passive::kWhateverComes;
  const AolPlus<1, 3>::Parts parts =
      contender.preset
          ? preset_parts(
                *contender.preset,
                {.friction = friction, .longest_hold = std::chrono::milliseconds(1), .encoder_step = kPaperEncoder})
                .parts
          : parts_without_preset(friction, kPaperEncoder);
  return parts.bounded_acceleration ? Passive::kAccelerating : Passive::kWhateverComes;
}

/// Lower bounds for the grid's hands on ideal springs, computed on demand.
class Floors {
 public:
  double median_of(const Contender& contender, const std::vector<Cell>& cells) {
    std::vector<double> floors;
    for (const Cell& cell : cells) {
      if (cell.name() != contender.name) continue;
      const Situation& s = cell.situation;
      const Passive sense = sense_of(contender, s.friction);
      const auto key = std::tuple(s.stiffness, s.friction.viscous, s.firm, sense);
      if (!known_.contains(key)) {
        known_[key] = floor_of(on_perfect_spring(s.stiffness, s.friction, s.firm), sense).error;
      }
      floors.push_back(known_[key]);
    }
    return median(floors);
  }

 private:
  std::map<std::tuple<double, double, bool, Passive>, double> known_;
};

/// The law with the least force error among those that guarantee passivity, were passive and stable throughout, and a
/// better one without guarantee, if any.
void recommend(std::ostream& out, const std::string& where, const std::vector<Summary>& laws) {
  const auto best_of = [&](bool promised) {
    const Summary* best = nullptr;
    for (const bool stable : {true, false}) {
      for (const Summary& law : laws) {
        if (law.contender.law == Law::kNone || law.contender.promises != promised || law.passive < 1) continue;
        if (stable && law.stable < 1) continue;
        if (best == nullptr || law.error < best->error) best = &law;
      }
      if (best != nullptr) break;
    }
    return best;
  };
  const auto percent = [](double share) { return text("%.1f", share * 100) + " %"; };
  const Summary* const safe = best_of(true);
  const Summary* const lucky = best_of(false);
  out << "  " << where << ": ";
  if (safe == nullptr) {
    out << "no law that keeps its promise.\n";
    return;
  }
  out << safe->contender.name << " (force error " << percent(safe->error) << ", stable in " << percent(safe->stable)
      << " of " << safe->cells << " cells)";
  if (lucky != nullptr && lucky->error < safe->error && lucky->stable >= safe->stable) {
    out << "; without a guarantee for every object: " << lucky->contender.name << " (" << percent(lucky->error) << ")";
  }
  out << ".\n";
}

void draw(const CompareOptions& options, const std::vector<Cell>& cells, std::vector<std::string>& pictures) {
  constexpr std::array kColours = {kOrange, kBlue, kGreen, kVermilion, kPurple, kSky};
  const std::array drawn = {info(Law::kPassivityController).name, info(Law::kAol).name, info(Law::kAolPlus).name,
                            info(Law::kEnergyBounding).name, info(Preset::kFeel).name};
  std::vector<Panel> panels;
  for (const TestDevice& device : {kDevices.front(), kDevices.back()}) {
    const bool damped = device.friction.viscous == kDevices.front().friction.viscous;
    Panel error{.title = damped ? "Force error, % of the true force: damped device" : "… device without damping",
                .x_label = "stiffness, N/m",
                .log_x = true};
    Panel vibration{.title = damped ? "Vibration, mm/s: damped device" : "… device without damping",
                    .x_label = "stiffness, N/m",
                    .log_x = true,
                    .log_y = true};
    for (std::size_t i = 0; i < drawn.size(); ++i) {
      Curve errors{.name = std::string(drawn[i]), .colour = kColours[i]};
      Curve vibrations = errors;
      for (const double k : kStiffnesses) {
        const auto at = summaries(cells, [&](const Situation& s) {
          return s.friction.viscous == device.friction.viscous && s.stiffness == k;
        });
        for (const Summary& summary : at) {
          if (summary.contender.name != drawn[i]) continue;
          errors.points.emplace_back(k, summary.error * 100);
          vibrations.points.emplace_back(k, std::max(summary.vibration * 1e3, 1e-3));
        }
      }
      error.curves.push_back(errors);
      vibration.curves.push_back(vibrations);
    }
    panels.push_back(error);
    panels.push_back(vibration);
  }
  for (const auto& file :
       draw_panels(*options.out / "compare", "Laws compared: medians over delay, rate, loss and hand",
                   std::to_string(cells.size()) + " cells; commit " + std::string(kCommit), panels, options.command)) {
    pictures.push_back(file.string());
  }
}

}  // namespace

std::vector<Situation> comparison_grid() {
  std::vector<Situation> grid;
  for (const double stiffness : kStiffnesses) {
    for (const double delay : {0.0, 5.0, 20.0, 80.0}) {
      for (const double jitter : {0.0, 10.0}) {
        for (const double rate : {1000.0, 200.0, 50.0, 25.0}) {
          for (const double loss : {0.0, 0.2}) {
            for (const TestDevice& device : kDevices) {
              for (const bool firm : {false, true}) {
                grid.push_back({.stiffness = stiffness,
                                .delay_ms = delay,
                                .jitter_ms = jitter,
                                .rate_hz = rate,
                                .loss = loss,
                                .friction = device.friction,
                                .firm = firm});
              }
            }
          }
        }
      }
    }
  }
  return grid;
}

Cell compare_cell(const Situation& situation, Law law, std::uint64_t seed) {
  return compare_cell(situation, law, seed, parts_without_preset(situation.friction, kPaperEncoder));
}

Cell compare_cell(const Situation& situation, Preset preset, std::uint64_t seed) {
  Cell cell{.situation = situation, .law = Law::kAolPlus, .outcome = {}, .preset = preset};
  cell.outcome = outcome_of({.name = info(preset).name, .preset = preset}, trial_of(situation, seed));
  return cell;
}

Cell compare_cell(const Situation& situation, Law law, std::uint64_t seed, const AolPlus<1, 3>::Parts& parts) {
  Experiment set = trial_of(situation, seed).experiment;
  set.limiter.law = law;
  set.limiter.parts = parts;
  return {situation, law, outcome(run(set), set.period)};
}

namespace {

Trial trial_of(const Situation& situation, std::uint64_t seed) {
  FreeHand hand = paper_hand(situation.friction);
  hand.hand->motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.015, .frequency = 0.5});
  if (situation.firm) {
    hand.hand->stiffness = 800;
    hand.hand->damping = 3;
    hand.hand->mass = 0.1;
  }
  Experiment set;
  set.environment = {.force = [k = situation.stiffness](double, const Vec3& x) { return Vec3(-k * x); },
                     .period = from_seconds(1 / situation.rate_hz),
                     .delay = from_seconds(situation.delay_ms * 1e-3),
                     .jitter = from_seconds(situation.jitter_ms * 1e-3),
                     .loss = situation.loss};
  set.hand = hand;
  set.limiter.friction = situation.friction;
  set.limiter.environment_stiffness = situation.stiffness;
  set.limiter.environment_delay = set.environment.delay;
  set.length = kLength;
  set.max_force = kPaperMaxForce;
  set.seed = seed;
  return {.experiment = set, .encoder_step = kPaperEncoder, .stiffness = situation.stiffness, .drawn = {}};
}

}  // namespace

Verdict verdict(const std::vector<Cell>& cells, std::uint64_t seed, std::size_t every) {
  Verdict result;
  const std::size_t each = contenders().size();
  for (std::size_t first = 0; first + each <= cells.size(); first += each) {
    const auto begin = cells.begin() + static_cast<std::ptrdiff_t>(first);
    const auto end = begin + static_cast<std::ptrdiff_t>(each);
    const auto plus =
        std::find_if(begin, end, [](const Cell& cell) { return cell.law == Law::kAolPlus && !cell.preset; });
    ++result.cells;
    if (plus->passive()) ++result.passive;
    const Cell* best = nullptr;
    for (auto cell = begin; cell != end; ++cell) {
      if (cell == plus || cell->preset || !info(cell->law).passive || !cell->passive()) continue;
      if (best == nullptr || cell->outcome.force_error < best->outcome.force_error) best = &*cell;
    }
    if (best == nullptr || best->outcome.force_error >= plus->outcome.force_error) continue;
    ++result.beaten;
    if (best->outcome.force_error < 0.95 * plus->outcome.force_error) ++result.beaten_clearly;

    const auto without = [&](auto drop) {
      auto parts = parts_without_preset(plus->situation.friction, kPaperEncoder);
      drop(parts);
      const Cell cell = compare_cell(plus->situation, Law::kAolPlus, seed + first / each * every, parts);
      return cell.outcome.force_error <= best->outcome.force_error;
    };
    using Parts = AolPlus<1, 3>::Parts;
    if (without([](Parts& parts) { parts.robust_ledger.reset(); })) {
      ++result.robust_ledger;
    } else if (without([](Parts& parts) { parts.knee.reset(); })) {
      ++result.knee;
    } else if (without([](Parts& parts) { parts.energy_cap.reset(); })) {
      ++result.energy_cap;
    } else if (without([](Parts& parts) { parts.bounded_acceleration.reset(); })) {
      ++result.bounded_acceleration;
    } else if (!plus->outcome.stable) {
      ++result.vibrating;
    } else {
      ++result.no_single_part;
    }
  }
  return result;
}

namespace {

std::vector<Cell> cells_of(const Situation& situation, std::uint64_t seed) {
  std::vector<Cell> cells;
  for (const Contender& contender : contenders()) {
    cells.push_back(contender.preset ? compare_cell(situation, *contender.preset, seed)
                                     : compare_cell(situation, contender.law, seed));
  }
  return cells;
}

Cell cell_of(const nlohmann::json& json) {
  const auto number = [&json](const char* name) { return number_of(json, name); };
  Cell cell{.situation = {.stiffness = number("stiffness_n_per_m"),
                          .delay_ms = number("delay_ms"),
                          .jitter_ms = number("jitter_ms"),
                          .rate_hz = number("rate_hz"),
                          .loss = number("loss"),
                          .friction = {.coulomb = number("fc_n"), .viscous = number("b_n_s_per_m")},
                          .firm = json.at("hand") == "firm"},
            .law = Law::kAolPlus,
            .outcome = {.operational_stiffness = number("k_op_n_per_m"),
                        .least_energy = number("least_energy_j"),
                        .late_vibration = number("hf_velocity_m_s"),
                        .sensation = number("sensation_db"),
                        .noticed_share = number("noticed_share"),
                        .largest_force = number("max_force_n"),
                        .limited_share = number("limited_share"),
                        .force_error = number("force_error_n"),
                        .true_force = number("true_force_n"),
                        .latency = number("latency_s")}};
  cell.outcome.stable = cell.outcome.late_vibration <= kMostVibration;
  const std::string name = json.at("law");
  for (const Contender& contender : contenders()) {
    if (contender.name != name) continue;
    cell.law = contender.law;
    cell.preset = contender.preset;
    return cell;
  }
  throw std::invalid_argument("law \"" + name + "\": unknown");
}

using Cells = std::vector<Cell>;

SweptWork<Cells> work_of(const CompareOptions& options) {
  std::vector<Situation> taken;
  const std::vector<Situation> grid = comparison_grid();
  for (std::size_t i = 0; i < grid.size(); i += options.every) taken.push_back(grid[i]);
  const std::uint64_t units = taken.size();
  const auto seed_of = [options](std::uint64_t unit) { return options.seed + unit * options.every; };
  return {.what = "situations",
          .units = units,
          .run = [taken, seed_of](std::uint64_t unit) { return cells_of(taken[unit], seed_of(unit)); },
          .lines =
              [seed_of](std::uint64_t unit, const Cells& cells) {
                std::vector<JsonLine> lines;
                for (const Cell& cell : cells) lines.push_back(json_of(cell, seed_of(unit)));
                return lines;
              },
          .read =
              [](std::uint64_t /*unit*/, const std::vector<nlohmann::json>& lines) {
                Cells cells;
                for (const auto& line : lines) cells.push_back(cell_of(line));
                if (cells.size() != contenders().size()) throw std::invalid_argument("expected a cell of each law");
                return cells;
              },
          .count =
              [](const Cells& cells, ShardEnd& end) {
                for (const Cell& cell : cells) {
                  end.count("cells", 1);
                  end.count("passive", cell.passive() ? 1 : 0);
                  end.count("stable", cell.outcome.stable ? 1 : 0);
                  end.lower("energy_j", cell.outcome.least_energy);
                  end.raise("force_n", cell.outcome.largest_force);
                }
              }};
}

void report(const std::vector<Cell>& cells, const CompareOptions& options, std::ostream& out);

}  // namespace

void compare(const CompareOptions& options, std::ostream& out) {
  if (options.every == 0) throw std::invalid_argument("--every must be 1 or more");
  std::vector<Cell> cells;
  std::uint64_t seed = options.seed;
  const auto situations = outcomes<Cells>(work_of(options), options.part, out, [&](const Cells& here) {
    if (options.json) {
      for (const Cell& cell : here) out << json_of(cell, seed).str() << "\n";
    }
    cells.insert(cells.end(), here.begin(), here.end());
    seed += options.every;
  });
  if (situations) report(cells, options, out);
}

namespace {

void report(const std::vector<Cell>& cells, const CompareOptions& options, std::ostream& out) {
  std::vector<std::string> written;
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    CsvTable table(options.command);
    for (std::size_t i = 0; i < cells.size(); ++i) {
      table.add(json_of(cells[i], options.seed + i / contenders().size() * options.every));
    }
    table.write(*options.out / "compare.csv");
    written.push_back((*options.out / "compare.csv").string());
    draw(options, cells, written);
  }
  if (options.json) {
    if (!out.flush()) throw std::runtime_error("cannot write the cells: is the disk full?");
    return;
  }

  out << cells.size() << " cells: " << cells.size() / contenders().size() << " situations, " << laws().size()
      << " laws and " << presets().size() << " presets; seed " << options.seed << ", commit " << kCommit << "\n\n";
  std::array<char, 200> line{};
  std::snprintf(line.data(), line.size(), "%-26s %8s %8s %11s %7s %6s %12s %7s %7s %7s %7s\n", "law", "passive",
                "stable", "given out J", "error", "floor", "vibration", "felt", "noticed", "limited", "latency");
  out << line.data();
  Floors floors;
  for (const Summary& s : summaries(cells, [](const Situation&) { return true; })) {
    std::snprintf(line.data(), line.size(),
                  "%-26s %6.1f %% %6.1f %% %11.2g %5.0f %% %4.0f %% %7.1f mm/s %4.0f dB %5.0f %% %5.0f %% %4.0f ms\n",
                  std::string(s.contender.name).c_str(), s.passive * 100, s.stable * 100, std::max(0.0, s.given_out),
                  s.error * 100, floors.median_of(s.contender, cells) * 100, s.vibration * 1e3, s.sensation,
                  s.noticed * 100, s.limited * 100, s.latency * 1e3);
    out << line.data();
  }
  out << "\n"
         "passive: the true ledger is never below -1 nJ. given out: largest value of all cells. Medians: error (rms, "
         "relative to the\n"
         "true force); floor (least error of any law with the same passivity on the ideal spring, see tendon-lab "
         "floor); vibration\n"
         "(last second); felt (the same in dB above the threshold of a hand); noticed (share of the time in which the "
         "error of the\n"
         "force is above "
      << kForceWeber * 100 << " %, the threshold of a hand); limited; latency. stable: vibration at most 8 mm/s.\n";
  out << "\n"
         "Which one to use (smallest median force error among the laws that guarantee passivity and were passive, if "
         "possible\n"
         "always stable):\n";
  for (const TestDevice& device : kDevices) {
    for (const bool soft : {true, false}) {
      const std::string object =
          std::string("device of ") + device.name + (soft ? ", up to 500 N/m, " : ", 1000 N/m and more, ");
      const auto here = [&](const Situation& s) {
        return s.friction.viscous == device.friction.viscous && (s.stiffness <= 500) == soft;
      };
      recommend(out, object + "on this machine (no delay, 1 kHz)", summaries(cells, [&](const Situation& s) {
                  return here(s) && s.delay_ms == 0 && s.jitter_ms == 0 && s.rate_hz == 1000;
                }));
      recommend(out, object + "near (at most 5 ms, at least 200 Hz)",
                summaries(cells, [&](const Situation& s) { return here(s) && s.delay_ms <= 5 && s.rate_hz >= 200; }));
      recommend(out, object + "far or slow (at least 20 ms, or at most 50 Hz)",
                summaries(cells, [&](const Situation& s) { return here(s) && (s.delay_ms >= 20 || s.rate_hz <= 50); }));
    }
  }

  const Verdict v = verdict(cells, options.seed, options.every);
  const auto share = [&](std::size_t n) {
    return std::to_string(n) + " (" + text("%.1f", 100.0 * static_cast<double>(n) / static_cast<double>(v.cells)) +
           " %)";
  };
  out << "\naol+ is passive in " << v.passive << " of its " << v.cells << " cells. In " << share(v.beaten)
      << " of them, another law that guarantees passivity and was passive has a smaller force\nerror; in "
      << share(v.beaten_clearly) << " by more than 5 %. In runs without one part, it would not have been beaten "
      << "without its robust\nledger (which accounts for the steps of the encoder) in " << v.robust_ledger
      << ", its knee in " << v.knee << ", its energy cap in " << v.energy_cap << ", bounded acceleration in "
      << v.bounded_acceleration << "; in " << v.vibrating
      << " it vibrates with an\nobject that is softer with the other law; in " << v.no_single_part
      << " the cause is no single part.\n";
  for (const std::string& file : written) out << "written: " << file << "\n";
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace
}  // namespace tendon::lab
