// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/paper.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>
#include <variant>

#include "core/base/portable_math.h"
#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/friction_tables.h"
#include "tests/tools/lab/pictures/csv.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

using std::chrono::milliseconds;

constexpr double kAmplitude = 0.015;  // m
constexpr double kFrequency = 0.25;   // Hz
struct RowKind {
  Law law;
  std::optional<Preset> preset{};
};
constexpr std::array kRowKinds = {RowKind{Law::kNone}, RowKind{Law::kAol}, RowKind{Law::kAolPlus},
                                  RowKind{Law::kAolPlus, Preset::kFeel}};

Environment spring(double stiffness) {
  return {.force = [stiffness](double, const Vec3& x) { return Vec3(-stiffness * x); }};
}

Environment with(Environment environment, Duration period, Duration delay) {
  environment.period = period;
  environment.delay = delay;
  return environment;
}

double triangle(double t, double period, double most) {
  const double phase = t / period - std::floor(t / period);
  return most * (1 - std::abs(2 * phase - 1));
}

PaperExperiment same_for_all(std::string name, std::string what, std::string assumed, const Environment& environment) {
  return {.name = std::move(name),
          .what = std::move(what),
          .assumed = std::move(assumed),
          .better = "cap, knee and robust ledger",
          .environment = environment,
          .uncontrolled = environment,
          .improved = environment};
}

std::vector<PaperExperiment> make_experiments() {
  std::vector<PaperExperiment> all;

  all.push_back(same_for_all("A", "time-varying: F = -2000 N/(m s) t x",
                             "coefficient (four digits survive as a length)",
                             {.force = [](double t, const Vec3& x) { return Vec3(-2000 * t * x); }}));
  all.back().k_op = 530;

  all.push_back(same_for_all("B", "nonlinear: F = -10 N/mm2 |x| x", "coefficient and exponent",
                             {.force = [](double, const Vec3& x) { return Vec3(-10e6 * x.norm() * x); }}));
  all.back().k_op = 530;

  all.push_back(same_for_all("C", "delay: F = -2000 N/m x, 300 ms late",
                             "stiffness (\"twenty times\" the 100 N/m which are unstable without control)",
                             with(spring(2000), milliseconds(1), milliseconds(300))));
  all.back().k_op = 180;
  all.back().uncontrolled = with(spring(100), milliseconds(1), milliseconds(300));
  all.back().improved.stiffness = [](double, const Vec3&) { return Mat3(2000 * Mat3::Identity()); };
  all.back().better = "a local model with the late force";

  all.push_back(
      same_for_all("D", "low rate: F = -5000 N/m x, 25 Hz", "nothing", with(spring(5000), milliseconds(40), {})));
  all.back().k_op = 16;
  all.back().period = milliseconds(40);
  all.back().better = "a limiter at 1 kHz, with forces at 25 Hz";

  all.push_back(same_for_all("E", "stiff: F = -4000 N/m x", "nothing", spring(4000)));
  all.back().k_op = 500;
  all.back().k_op_most = 600;

  // Stiffness is below 520 N/m for 136 ms of each period, as from 3.054 to 3.190 s in Fig. 12(d).
  all.push_back(same_for_all("12", "stiffness up to 3000 N/m and down to 0 again every 0.78 s", "law and coefficient",
                             {.force = [](double t, const Vec3& x) { return Vec3(-triangle(t, 0.78, 3000) * x); }}));

  // After learning 840 N/m, an estimator overestimates the force by 3/2 at 560: by more than 4 N. The change occurs at
  // the greatest depth and is known with the next answer.
  const auto softens = [](double t) { return t < 1 || (t >= 2 && t < 3) || t >= 4 ? 840.0 : 560.0; };
  all.push_back(same_for_all("14", "output estimator, 25 Hz and 40 ms late; 840 N/m become 560 at 1 s and 3 s",
                             "the object, when it changed, the estimator's reset threshold",
                             with({.force = [softens](double t, const Vec3& x) { return Vec3(-softens(t) * x); }},
                                  milliseconds(40), milliseconds(40))));
  all.back().estimator.emplace();
  return all;
}

std::string fixed(double value, int digits) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", digits, value);
  return text.data();
}

std::string cell(const std::string& text, std::size_t width) {
  return text.size() >= width ? text + " " : std::string(width - text.size(), ' ') + text;
}

std::string paper_figure(const PaperExperiment& experiment) {
  if (!experiment.k_op) return "-";
  return fixed(*experiment.k_op, 0) + (experiment.k_op_most ? "-" + fixed(*experiment.k_op_most, 0) : "");
}

template <class Pick>
std::vector<std::pair<double, double>> over_time(const std::vector<Moment>& record, Pick pick) {
  std::vector<std::pair<double, double>> points;
  points.reserve(record.size());
  for (const Moment& m : record) points.emplace_back(m.t, pick(m));
  return points;
}

double millimetres(const Moment& m) { return m.position.x() * 1e3; }
double millijoules(const Moment& m) { return m.energy * 1e3; }
double applied(const Moment& m) { return m.step.force.x(); }
double wanted(const Moment& m) { return m.step.wanted.x(); }
double permitted(const Moment& m) { return m.step.permitted; }

/// As in Figs. 7 to 14: the free hand without control, with AOL and AOL+, its forces, the energy.
std::vector<Panel> figure(const PaperExperiment& experiment, const PaperRow& none, const PaperRow& aol,
                          const PaperRow& plus) {
  const std::pair<double, double> whole{0, 5};
  std::pair<double, double> forces{-kPaperMaxForce * 1.15, kPaperMaxForce * 1.15};
  Panel position{.title = "Position, mm", .x_label = "time, s", .x_range = whole};
  position.curves = {{"AOL", kBlue, over_time(aol.free_record, millimetres)},
                     {"AOL+", kGreen, over_time(plus.free_record, millimetres), Curve::Style::kDashed}};
  Panel force{.title = "Force on the hand, N (AOL)", .x_label = "time, s", .x_range = whole, .y_range = forces};
  force.curves = {{"permitted", kSky, over_time(aol.free_record, permitted), Curve::Style::kArea},
                  {"wanted", kOrange, over_time(aol.free_record, wanted)},
                  {"applied", kBlue, over_time(aol.free_record, applied)},
                  {"applied by AOL+", kGreen, over_time(plus.free_record, applied), Curve::Style::kDashed}};
  Panel energy{.title = "Energy put in and not given back, mJ", .x_label = "time, s", .x_range = whole};
  energy.curves = {{"AOL", kBlue, over_time(aol.free_record, millijoules)},
                   {"AOL+", kGreen, over_time(plus.free_record, millijoules), Curve::Style::kDashed}};
  if (experiment.name == "12") {
    Panel zoom = force;
    zoom.title = "Force, N, from 2.8 to 3.6 s";
    zoom.x_range = {2.8, 3.6};
    return {position, energy, force, zoom};
  }
  Panel without{.title = "Without control: position, mm", .x_label = "time, s", .x_range = whole};
  without.curves = {{"", kVermilion, over_time(none.free_record, millimetres)}};
  if (experiment.name == "14") {
    Panel unlimited{.title = "Without control: force, N", .x_label = "time, s", .x_range = whole, .y_range = forces};
    unlimited.curves = {{"estimated", kOrange, over_time(none.free_record, wanted)},
                        {"true", kInk, over_time(none.free_record, [](const Moment& m) { return m.true_force.x(); })}};
    return {unlimited, without, force, position};
  }
  return {without, position, force, energy};
}

}  // namespace

const std::vector<PaperExperiment>& paper_experiments() {
  static const std::vector<PaperExperiment> kAll = make_experiments();
  return kAll;
}

AolPlus<1, 3>::Parts default_parts(double encoder_step) {
  AolPlus<1, 3>::Parts parts;
  parts.energy_cap.emplace();
  if (encoder_step > 0) parts.robust_ledger.emplace().encoder_step = {encoder_step};
  parts.knee.emplace();
  return parts;
}

AolPlus<1, 3>::Parts low_friction_parts(double encoder_step) {
  AolPlus<1, 3>::Parts parts = default_parts(encoder_step);
  auto& bounded = parts.bounded_acceleration.emplace();
  bounded.most = {300};
  parts.shaping.emplace().stiffness = {600};
  return parts;
}

AolPlus<1, 3>::Parts parts_without_preset(const Friction& friction, double encoder_step) {
  return friction.viscous >= 0.1 ? default_parts(encoder_step) : low_friction_parts(encoder_step);
}

PrescribedMotion paper_motion(const Friction& friction, double encoder_step, const Vec3& direction) {
  return {.position =
              [direction](double t) {
                return Vec3(kAmplitude * portable::sin(2 * std::numbers::pi * kFrequency * t) * direction);
              },
          .friction = friction,
          .encoder_step = encoder_step};
}

FreeHand paper_hand(const Friction& friction, const Vec3& direction) {
  FreeHand config;
  config.mass = 0.075;
  config.viscous_friction = friction.viscous;
  config.coulomb_friction = friction.coulomb;
  config.encoder_step = kPaperEncoder;
  config.max_force = kPaperMaxForce;
  config.hand = {.stiffness = 400,
                 .damping = 0.3,
                 .mass = 0.05,
                 .motion = ScriptedMotion(
                     ScriptedMotion::Sine{.amplitude = kAmplitude, .frequency = kFrequency, .direction = direction})};
  return config;
}

double PaperRow::least_energy() const { return std::min(prescribed.least_energy, free.least_energy); }

PaperRow paper_row(const PaperExperiment& experiment, Law law, std::optional<Preset> preset) {
  const bool improved = law == Law::kAolPlus;
  const double encoder = improved ? kPaperEncoder : 0;
  Experiment set;
  set.environment = improved ? experiment.improved : experiment.environment;
  set.limiter = {.law = law, .friction = kPaperFriction};
  if (improved) set.limiter.parts = default_parts(kPaperEncoder);
  set.period = improved ? milliseconds(1) : experiment.period;
  set.max_force = kPaperMaxForce;
  set.estimator = experiment.estimator;
  if (preset) {
    const PresetParts chosen =
        preset_parts(*preset, {.friction = kPaperFriction, .longest_hold = set.period, .encoder_step = kPaperEncoder});
    set.limiter.parts = chosen.parts;
    set.learned_model = chosen.learned_model;
    set.estimator.reset();
  }
  set.hand = paper_motion(kPaperFriction, encoder);

  PaperRow row;
  row.experiment = experiment.name;
  row.law = preset ? info(*preset).name : info(law).name;
  row.k_op_paper = experiment.k_op;
  row.prescribed_record = run(set);
  row.prescribed = outcome(row.prescribed_record, set.period);
  if (law == Law::kNone) set.environment = experiment.uncontrolled;
  set.hand = paper_hand(kPaperFriction);
  row.free_record = run(set);
  row.free = outcome(row.free_record, set.period);
  return row;
}

namespace {

JsonLine json_of(const PaperRow& row) {
  JsonLine line;
  line.add("experiment", row.experiment)
      .add("law", row.law)
      .add("k_op_n_per_m", row.prescribed.operational_stiffness)
      .add("k_op_paper", row.k_op_paper)
      .add("min_energy_j", row.least_energy())
      .add("hf_velocity_m_s", row.free.late_vibration)
      .add("stable", row.free.stable)
      .add("max_force_n", row.prescribed.largest_force)
      .add("limited_share", row.prescribed.limited_share)
      .add("seed", 0)
      .add("scene", "15 mm at 0.25 Hz, b 0.26 N s/m, f_c 0.005 N")
      .add("commit", kCommit);
  return line;
}

PaperRow row_of(const nlohmann::json& line) {
  PaperRow row;
  row.experiment = line.at("experiment");
  row.law = line.at("law");
  if (const auto& k = line.at("k_op_paper"); !k.is_null()) row.k_op_paper = k.get<double>();
  row.prescribed.operational_stiffness = number_of(line, "k_op_n_per_m");
  row.prescribed.least_energy = row.free.least_energy = number_of(line, "min_energy_j");
  row.prescribed.largest_force = number_of(line, "max_force_n");
  row.prescribed.limited_share = number_of(line, "limited_share");
  row.free.late_vibration = number_of(line, "hf_velocity_m_s");
  row.free.stable = line.at("stable");
  return row;
}

using AnyRow = std::variant<PaperRow, FrictionTable>;

PaperRow run_row(std::size_t experiment, std::size_t kind, bool drawn) {
  PaperRow row = paper_row(paper_experiments().at(experiment), kRowKinds.at(kind).law, kRowKinds.at(kind).preset);
  row.prescribed_record = {};
  if (!drawn) row.free_record = {};
  return row;
}

SweptWork<AnyRow> work_of(const PaperOptions& options) {
  const bool drawn = options.out && !options.part.units;
  const std::size_t experiments = paper_experiments().size() * kRowKinds.size();
  return {.what = "rows",
          .units = experiments + kTableDampings.size(),
          .run = [experiments, drawn](std::uint64_t unit) -> AnyRow {
            if (unit >= experiments) return friction_table(kTableDampings.at(unit - experiments));
            return run_row(unit / kRowKinds.size(), unit % kRowKinds.size(), drawn);
          },
          .lines =
              [](std::uint64_t /*unit*/, const AnyRow& row) {
                std::vector<JsonLine> lines;
                lines.push_back(std::visit([](const auto& one) { return json_of(one); }, row));
                return lines;
              },
          .read = [experiments](std::uint64_t unit, const std::vector<nlohmann::json>& lines) -> AnyRow {
            if (unit >= experiments) return friction_table_of(lines.at(0));
            return row_of(lines.at(0));
          },
          .count =
              [](const AnyRow& row, ShardEnd& end) {
                const PaperRow* const one = std::get_if<PaperRow>(&row);
                end.count("rows", 1);
                end.count("stable", one != nullptr && one->free.stable ? 1 : 0);
                end.lower("energy_j", one != nullptr ? one->least_energy() : 0);
              }};
}

}  // namespace

void paper(const PaperOptions& options, std::ostream& out) {
  const auto all = outcomes(work_of(options), options.part, out);
  if (!all) return;
  if (options.out) std::filesystem::create_directories(*options.out);
  if (!options.json) {
    out << "Lee & Lee 2009, section III: b = 0.26 N s/m, f_c = 0.005 N, 15 mm at 0.25 Hz, 5 s; commit " << kCommit
        << "\n\n"
        << "     law    K_op N/m     paper  least energy J  vibration m/s  stable  largest force N  limited\n";
  }
  CsvTable csv(options.command);
  std::vector<std::filesystem::path> pictures;
  for (std::size_t i = 0; i < paper_experiments().size(); ++i) {
    const PaperExperiment& experiment = paper_experiments()[i];
    std::vector<PaperRow> rows;
    for (std::size_t kind = 0; kind < kRowKinds.size(); ++kind) {
      rows.push_back(std::get<PaperRow>(all->at(i * kRowKinds.size() + kind)));
    }
    if (!options.json) out << experiment.name << "  " << experiment.what << "\n";
    for (const PaperRow& row : rows) {
      csv.add(json_of(row));
      if (options.json) {
        out << json_of(row).str() << "\n";
        continue;
      }
      out << cell(row.law, 8) << cell(fixed(row.prescribed.operational_stiffness, 0), 12)
          << cell(paper_figure(experiment), 10) << cell(fixed(row.least_energy(), 6), 16)
          << cell(fixed(row.free.late_vibration, 4), 15) << cell(row.free.stable ? "yes" : "no", 8)
          << cell(fixed(row.prescribed.largest_force, 2), 17)
          << cell(fixed(row.prescribed.limited_share * 100, 0) + " %", 9) << "\n";
    }
    if (!options.json)
      out << "     assumed: " << experiment.assumed << "; aol+ and feel: " << experiment.better << "\n";
    if (options.out) {
      if (options.part.from) {
        for (std::size_t kind = 0; kind < 3; ++kind) rows[kind] = run_row(i, kind, true);
      }
      const auto drawn = draw_panels(
          *options.out / ("paper-" + experiment.name), "Experiment " + experiment.name + ": " + experiment.what,
          "free hand; commit " + std::string(kCommit), figure(experiment, rows[0], rows[1], rows[2]), options.command);
      pictures.insert(pictures.end(), drawn.begin(), drawn.end());
    }
  }
  std::vector<FrictionTable> friction;
  for (const AnyRow& row : *all) {
    if (const auto* const table = std::get_if<FrictionTable>(&row)) friction.push_back(*table);
  }
  for (const FrictionTable& table : friction) csv.add(json_of(table));
  if (options.out) csv.write(*options.out / "paper.csv");
  if (options.json) {
    for (const FrictionTable& table : friction) out << json_of(table).str() << "\n";
  } else {
    write(out, friction);
    out << "\n"
           "K_op, largest force and share limited are for the prescribed motion; vibration (rms faster than 50 ms, "
           "last second) and\n"
           "stable for a hand that is free to move (400 N/m, 0.3 N s/m). stable: at most 8 mm/s.\n";
    for (const auto& picture : pictures) out << "picture: " << picture.string() << "\n";
  }
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace tendon::lab
