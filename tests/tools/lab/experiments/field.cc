// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/field.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "tests/support/json_line.h"
#include "tests/tools/lab/pictures/csv.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

constexpr field::EnergyGate::Config kTank{.push_j = 0.05, .push_w = 1};
constexpr double kLoss = 0.05;

/// How a scene is rendered.
struct Variant {
  FieldMethod method = FieldMethod::kHeld;
  bool ahead = true;
  field::EnergyGate::Config push{};

  std::string name() const {
    std::string text(to_string(method));
    if (!ahead) text += ", late";
    if (push.push_j > 0) text += ", tank";
    return text;
  }
};

std::vector<Variant> variants_of(const FieldScene& scene) {
  std::vector<Variant> all = {
      {FieldMethod::kHeld}, {FieldMethod::kPlane}, {FieldMethod::kField}, {FieldMethod::kLearned}};
  if (!scene.pose) return all;
  all.insert(all.begin() + 2, {FieldMethod::kField, false});
  all.push_back({FieldMethod::kField, false, kTank});
  all.push_back({FieldMethod::kField, true, kTank});
  all.push_back({FieldMethod::kLearned, true, kTank});
  return all;
}

struct Network {
  std::string label;
  std::string profile;
  double loss = 0;
};

std::string profile_of(int round_trip_ms) { return "delay=" + std::to_string(500 * round_trip_ms) + "us"; }

std::vector<Network> networks_of(const FieldOptions& options) {
  std::vector<Network> all;
  for (const std::string& name : options.networks) all.push_back({name, name, 0});
  if (!all.empty()) return all;
  for (const int ms : options.round_trips_ms) {
    if (ms < 0 || ms > 10'000) throw std::invalid_argument("round trips: expected 0 to 10000 ms");
    all.push_back({std::to_string(ms) + " ms", profile_of(ms), kLoss});
  }
  return all;
}

std::vector<const FieldScene*> scenes_of(const FieldOptions& options) {
  std::vector<const FieldScene*> all;
  std::string names;
  for (const FieldScene& scene : field_scenes()) {
    names += (names.empty() ? "" : ", ") + scene.name;
    if (options.scenes.empty() || std::ranges::find(options.scenes, scene.name) != options.scenes.end()) {
      all.push_back(&scene);
    }
  }
  for (const std::string& name : options.scenes) {
    if (std::ranges::find(field_scenes(), name, &FieldScene::name) == field_scenes().end()) {
      throw std::invalid_argument("scene \"" + name + "\" is unknown, expected one of " + names);
    }
  }
  return all;
}

void add(FieldRun& mean, const FieldRun& run, double share) {
  mean.error += share * run.error;
  mean.late_error += share * run.late_error;
  mean.bound += share * run.bound;
  mean.tank += share * run.tank;
  mean.jump = std::max(mean.jump, run.jump);
  mean.true_jump = std::max(mean.true_jump, run.true_jump);
  mean.least_energy = std::min(mean.least_energy, run.least_energy);
}

JsonLine line_of(const FieldRow& row, const FieldOptions& options) {
  JsonLine line;
  line.add("scene", row.scene->name)
      .add("method", to_string(row.method))
      .add("network", row.network)
      .add("poses_ahead", row.ahead)
      .add("push_j", row.push.push_j)
      .add("push_w", row.push.push_w)
      .add("error_percent", 100 * row.mean.error)
      .add("late_error_percent", 100 * row.mean.late_error)
      .add("jump_n_per_ms", row.mean.jump)
      .add("true_jump_n_per_ms", row.mean.true_jump)
      .add("least_energy_j", row.mean.least_energy)
      .add("bound_percent", 100 * row.mean.bound)
      .add("tank_j", row.mean.tank)
      .add("count_um", options.count_um)
      .add("hands", options.hands)
      .add("seed", options.seed);
  return line;
}

std::string text_of(const char* format, auto... values) {
  std::array<char, 128> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

/// Prints a line for each variant of each scene. There is a column for each network.
void print(const std::vector<FieldRow>& rows, std::size_t networks, std::ostream& out) {
  out << "rms error, % of the true force, and (largest jump, N/ms)\nscene       method            ";
  for (std::size_t i = 0; i < networks; ++i) out << text_of("%15.15s", rows[i].network.c_str());
  out << "  least E, J  gate binds  tank\n";
  for (std::size_t i = 0; i < rows.size(); i += networks) {
    const FieldRow& row = rows[i];
    out << text_of("%-12s%-18s", row.scene->name.c_str(), Variant{row.method, row.ahead, row.push}.name().c_str());
    FieldRun all;
    for (std::size_t j = i; j < i + networks; ++j) {
      const FieldRun& mean = rows[j].mean;
      out << text_of("%8.1f (%4.2f)", 100 * mean.error, mean.jump);
      add(all, mean, 1 / static_cast<double>(networks));
    }
    out << text_of("%12.2g%10.1f %%%7.1f mJ\n", all.least_energy, 100 * all.bound, 1e3 * all.tank);
  }
}

void draw(const std::vector<FieldRow>& rows, const FieldOptions& options, std::ostream& out) {
  constexpr double kMostError = 160;  // %
  const auto colour_of = [](const Variant& variant) {
    if (variant.method == FieldMethod::kHeld) return kVermilion;
    if (variant.method == FieldMethod::kPlane) return kOrange;
    if (variant.method == FieldMethod::kLearned) return variant.push.push_j > 0 ? kInk : kGreen;
    if (variant.push.push_j > 0) return variant.ahead ? kPurple : kPale;
    return variant.ahead ? kBlue : kSky;
  };
  const std::size_t networks = options.round_trips_ms.size();
  std::vector<Panel> panels;
  for (std::size_t i = 0; i < rows.size(); i += networks) {
    const FieldRow& row = rows[i];
    const std::string title = row.scene->name + ": rms error, % of the true force";
    if (panels.empty() || panels.back().title != title) {
      panels.push_back({.title = title, .x_label = "round trip, ms", .y_range = std::pair{0.0, kMostError}});
    }
    const Variant variant{row.method, row.ahead, row.push};
    Curve curve{.name = variant.name(), .colour = colour_of(variant)};
    curve.style = row.method == FieldMethod::kLearned ? Curve::Style::kDashed : Curve::Style::kBold;
    for (std::size_t j = 0; j < networks; ++j) {
      curve.points.emplace_back(options.round_trips_ms[j], std::min(100 * rows[i + j].mean.error, kMostError));
    }
    panels.back().curves.push_back(curve);
  }
  const std::string figures = "mean of n = " + std::to_string(options.hands) + " hands from seed " +
                              std::to_string(options.seed) +
                              "; the engine runs at 60 Hz, and the network drops 5 % of its datagrams";
  for (const auto& file : draw_panels(*options.out / "field", "A remote object as forces, as a plane, and as a field",
                                      figures, panels, options.command)) {
    out << "picture: " << file.string() << '\n';
  }
}

}  // namespace

std::vector<FieldRow> field_rows(const FieldOptions& options) {
  if (options.hands < 1 || options.hands > 1000) throw std::invalid_argument("hands: expected 1 to 1000");
  if (options.milliseconds <= 500 || options.milliseconds > 100'000) {
    throw std::invalid_argument("milliseconds: expected 501 to 100000");
  }
  if (!(options.count_um >= 0 && options.count_um <= 1000)) {
    throw std::invalid_argument("counts: expected 0 to 1000 µm");
  }
  const std::vector<Network> networks = networks_of(options);
  std::vector<FieldRow> rows;
  for (const FieldScene* scene : scenes_of(options)) {
    const std::size_t first = rows.size();
    for (const Variant& variant : variants_of(*scene)) {
      for (const Network& network : networks) {
        rows.push_back({scene, variant.method, variant.ahead, variant.push, network.label});
      }
    }
    for (int hand = 0; hand < options.hands; ++hand) {
      const std::uint64_t seed = options.seed + static_cast<std::uint64_t>(hand);
      const std::vector<Vec3> truth = true_forces(*scene, field_hand(seed), options.milliseconds);
      for (std::size_t i = first; i < rows.size(); ++i) {
        const Network& network = networks[(i - first) % networks.size()];
        const FieldCase of{.scene = scene,
                           .method = rows[i].method,
                           .network = network.profile,
                           .loss = network.loss,
                           .seed = seed,
                           .count = 1e-6 * options.count_um,
                           .push = rows[i].push,
                           .ahead = rows[i].ahead};
        add(rows[i].mean, run_field(of, truth), 1.0 / options.hands);
      }
    }
  }
  return rows;
}

void field_experiment(const FieldOptions& options, std::ostream& out) {
  if (options.far) return draw_far_field(options, out);
  const std::vector<FieldRow> rows = field_rows(options);
  CsvTable table(options.command);
  for (const FieldRow& row : rows) {
    const JsonLine line = line_of(row, options);
    table.add(line);
    if (options.json) out << line.str() << '\n';
  }
  if (!options.json) print(rows, networks_of(options).size(), out);
  if (!options.out) return;
  std::filesystem::create_directories(*options.out);
  table.write(*options.out / "field.csv");
  if (options.networks.empty()) draw(rows, options, out);
}

void draw_far_field(const FieldOptions& options, std::ostream& out) {
  if (!options.out) throw std::invalid_argument("--far: expected --out, because it only draws a picture");
  struct Row {
    const char* scene;
    const char* what;
    int axis;  ///< of the force
  };
  constexpr std::array kRows = {Row{"sphere", "Sphere with friction: ", 2}, Row{"slot", "Slot of 3 mm: ", 0}};
  constexpr std::array kColumns = {std::pair{FieldMethod::kHeld, "held force"},
                                   std::pair{FieldMethod::kPlane, "held force with its plane"},
                                   std::pair{FieldMethod::kField, "field"}};
  std::vector<Panel> panels;
  for (const Row& row : kRows) {
    const FieldScene& scene = *std::ranges::find(field_scenes(), row.scene, &FieldScene::name);
    const std::vector<Vec3> truth = true_forces(scene, field_hand(options.seed), options.milliseconds);
    std::pair<double, double> range{0, 0};
    const auto curve = [&](std::string name, const char* colour, Curve::Style style, const std::vector<Vec3>& forces) {
      Curve result{.name = std::move(name), .colour = colour, .style = style};
      for (std::size_t i = 0; i < forces.size(); ++i) {
        const double force = forces[i][row.axis];
        result.points.emplace_back(1e-3 * static_cast<double>(i), force);
        range = {std::min(range.first, force - 0.2), std::max(range.second, force + 0.2)};
      }
      return result;
    };
    for (const auto& [method, name] : kColumns) {
      Panel panel{.title = std::string(row.what) + name, .x_label = "time, s"};
      panel.curves.push_back(curve("true force, N", kPale, Curve::Style::kBold, truth));
      for (const int ms : {600, 200}) {
        const FieldCase of{.scene = &scene,
                           .method = method,
                           .network = profile_of(ms),
                           .loss = kLoss,
                           .seed = options.seed,
                           .milliseconds = options.milliseconds};
        const FieldRun run = run_field(of, truth);
        const double error = 100 * run.error;
        panel.curves.push_back(curve(text_of("%d ms: %.*f %%", ms, error < 10 ? 1 : 0, error),
                                     ms == 600 ? kVermilion : kSky, Curve::Style::kLine, run.force));
      }
      panels.push_back(std::move(panel));
    }
    for (std::size_t i = panels.size() - kColumns.size(); i < panels.size(); ++i) panels[i].y_range = range;
  }
  std::filesystem::create_directories(*options.out);
  const std::string figures = "One hand (seed " + std::to_string(options.seed) +
                              "). The engine runs at 60 Hz, and the network drops 5 % of its datagrams. The "
                              "numbers are the rms error in percent of the rms of the true force.";
  for (const auto& file :
       draw_panels(*options.out / "far", "Round trips of 200 and 600 ms to the object that is touched", figures, panels,
                   options.command, {}, static_cast<int>(kColumns.size()))) {
    out << "picture: " << file.string() << '\n';
  }
}

}  // namespace tendon::lab
