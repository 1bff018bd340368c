// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/table.h"

namespace tendon::lab {
namespace {

// Horizontal positions are pixels from the left: more runs make the picture wider.
constexpr double kColumn = 800;
constexpr double kLeft = 68;   ///< for the axis labels
constexpr double kRight = 16;  ///< for half of the last label of the x axis
constexpr int kHeight = 1000;

// Vertical positions are fractions of the height from the bottom.
constexpr double kHeading = 0.965;
constexpr double kFigures = 0.927;
constexpr double kMoreFigures = 0.902;
constexpr double kPanelHeight = 0.225;
constexpr std::array kPanelTops = {0.840, 0.565, 0.290};
constexpr double kAbovePanel = 0.018;

/// Beyond this ratio of energy ranges, each run has its own scale; otherwise one would be a flat line.
constexpr double kTooDifferent = 20;
/// The wanted force is unbounded; limits it to this multiple so that the applied force remains visible.
constexpr double kMostWanted = 3;

double picture_width(std::size_t drawings) { return kColumn * static_cast<double>(std::max<std::size_t>(drawings, 2)); }

struct Scale {
  double least;
  double most;

  double size() const { return most - least; }
  Scale widened(double share) const { return {least - share * size(), most + share * size()}; }
};

Extremes extremes(std::span<const Drawing> drawings, Extremes Trace::Column::*what) {
  Extremes all;
  for (const Drawing& drawing : drawings)
    for (const Trace::Column& column : drawing.trace.columns()) all.observe(column.*what);
  return all;
}

Scale position_scale(std::span<const Drawing> drawings) {
  Extremes all = extremes(drawings, &Trace::Column::position);
  if (all.empty()) all.observe(0);
  constexpr double kLeast = 1e-3;  // m: smaller ranges would show noise as motion
  const double missing = std::max(kLeast - (all.most - all.least), 0.0);
  return Scale{(all.least - missing / 2) * 1e3, (all.most + missing / 2) * 1e3}.widened(0.08);
}

Scale force_scale(std::span<const Drawing> drawings) {
  const Extremes applied = extremes(drawings, &Trace::Column::applied);
  const Extremes wanted = extremes(drawings, &Trace::Column::wanted);
  const Extremes permitted = extremes(drawings, &Trace::Column::permitted);
  const double peak = applied.empty() ? 0 : std::max({applied.most, -applied.least, 0.1});
  const double band = permitted.empty() ? 0 : std::min(permitted.most, peak);
  Scale scale{std::min(-band, 0.0), std::max(band, 0.0)};
  for (const Extremes& force : {applied, wanted}) {
    if (force.empty()) continue;
    scale.least = std::min(scale.least, std::max(force.least, -kMostWanted * peak));
    scale.most = std::max(scale.most, std::min(force.most, kMostWanted * peak));
  }
  return scale.size() > 0 ? scale.widened(0.08) : Scale{-1, 1};
}

Scale energy_scale(std::span<const Drawing> drawings) {
  Extremes all = extremes(drawings, &Trace::Column::energy);
  all.observe(0);
  if (all.most - all.least < 1e-9) all.observe(1e-9);
  Scale scale = Scale{all.least, all.most}.widened(0.08);
  scale.least = std::min(scale.least, -0.15 * scale.size());  // values below zero are always visible
  return scale;
}

std::vector<Scale> energy_scales(std::span<const Drawing> drawings) {
  std::vector<Scale> own;
  for (std::size_t i = 0; i < drawings.size(); ++i) own.push_back(energy_scale(drawings.subspan(i, 1)));
  const auto [least, most] = std::ranges::minmax(own, {}, &Scale::size);
  if (most.size() <= kTooDifferent * least.size()) own.assign(drawings.size(), energy_scale(drawings));
  return own;
}

struct Unit {
  const char* name;
  double per_si;
};
Unit energy_unit(const Scale& scale) {
  const double size = std::max(scale.most, -scale.least);
  if (size >= 1) return {"J", 1};
  if (size >= 1e-3) return {"mJ", 1e3};
  if (size >= 1e-6) return {"µJ", 1e6};
  return {"nJ", 1e9};
}

std::string axis_name(const Vec3& axis) {
  for (Eigen::Index i = 0; i < 3; ++i)
    if (axis == Vec3(Vec3::Unit(i))) return {"xyz"[i]};
  std::ostringstream name;
  name.precision(2);
  name << "(" << axis.x() << ", " << axis.y() << ", " << axis.z() << ")";
  return name.str();
}

/// Formats as " (scale 1000 × finer)", with one significant digit.
std::string stretched(double ratio) {
  const double power = std::pow(10, std::floor(std::log10(ratio)));
  std::ostringstream text;
  text << " (scale " << static_cast<std::uint64_t>(std::round(ratio / power) * power) << " × finer)";
  return text.str();
}

class Script {
 public:
  explicit Script(std::span<const Drawing> drawings)
      : drawings_(drawings),
        position_(position_scale(drawings)),
        force_(force_scale(drawings)),
        energy_(energy_scales(drawings)),
        width_(picture_width(drawings.size())),
        column_(width_ / static_cast<double>(drawings.size())) {
    for (const Drawing& drawing : drawings) span_ = std::max(span_, seconds(drawing.trace.config().span));
    span_ = std::ceil(span_ * 100) / 100;  // rounds a run of 9.999 s up to 10 s
  }

  std::string write(const std::filesystem::path& path) {
    begin(path);
    for (std::size_t i = 0; i < drawings_.size(); ++i) write_data(i);
    out_ << "set multiplot\n";
    for (std::size_t i = 0; i < drawings_.size(); ++i) {
      write_heading(i);
      draw_position(i);
      draw_force(i);
      draw_energy(i);
    }
    out_ << "unset multiplot\nunset output\n";
    return out_.str();
  }

 private:
  void begin(const std::filesystem::path& path) {
    out_ << begin_picture(path, static_cast<int>(width_), kHeight) << "set border 3 lc rgb '" << kPale << "'\n"
         << "set tics nomirror out scale 0.6 textcolor rgb '" << kPale << "'\n"
         << "set grid ytics lc rgb '#e4e4e4' lt 1 lw 1\n"
         << "set xrange [0:" << span_ << "]\n"
         << "set datafile missing 'NaN'\n";
  }

  /// Writes three blocks per drawing. $run: time, position, wanted, applied, energy, two rows per nonempty column;
  /// $bound: time, permitted; $overruns: time.
  void write_data(std::size_t i) {
    const Trace& trace = drawings_[i].trace;
    const double per_si = energy_unit(energy_[i]).per_si;
    std::ostringstream bound;
    std::ostringstream overruns;
    const auto value = [](double v) {
      std::ostringstream text;
      if (std::isfinite(v)) {
        text << v;
      } else {
        text << "NaN";
      }
      return text.str();
    };
    out_ << "$run" << i << " << EOD\n";
    for (std::size_t c = 0; c < trace.columns().size(); ++c) {
      const Trace::Column& column = trace.columns()[c];
      if (column.empty()) continue;
      const double time = trace.time(c);
      const auto row = [&](auto pick) {
        out_ << time << " " << value(pick(column.position) * 1e3) << " " << value(pick(column.wanted)) << " "
             << value(pick(column.applied)) << " " << value(pick(column.energy) * per_si) << "\n";
      };
      row([](const Extremes& e) { return e.first(); });
      row([](const Extremes& e) { return e.second(); });
      if (!column.permitted.empty()) bound << time << " " << value(column.permitted.most) << "\n";
      if (column.overrun) overruns << time << "\n";
    }
    out_ << "EOD\n$bound" << i << " << EOD\n" << bound.str() << "EOD\n";
    out_ << "$overruns" << i << " << EOD\n" << overruns.str() << "EOD\n";
  }

  double left(std::size_t i) const { return (static_cast<double>(i) * column_ + kLeft) / width_; }
  double right(std::size_t i) const { return (static_cast<double>(i + 1) * column_ - kRight) / width_; }

  std::ostringstream& label(double x, double y, const std::string& text) {
    out_ << "set label " << literal(text) << " at screen " << x << "," << y << " noenhanced ";
    return out_;
  }

  void write_heading(std::size_t i) {
    const Drawing& drawing = drawings_[i];
    const RunSummary& run = drawing.summary;
    label(left(i), kHeading, drawing.label) << "font ':Bold,20' tc rgb '" << kInk << "'\n";

    const std::string given_out = with_unit(run.energy_given_out, "J");
    std::string verdict = "active: gave out " + given_out + " that was never put in";
    if (run.passive()) {
      verdict = "passive: gave out no energy that was never put in";
    } else if (run.kept_its_promise()) {
      verdict = "gave out " + given_out + ", only in holds longer than the limiter's bound";
    }
    label(left(i), kFigures, verdict) << "tc rgb '" << (run.kept_its_promise() ? kGreen : kVermilion) << "'\n";

    std::string figures = "peak " + with_unit(run.peak_force, "N") + ", " + with_unit(run.peak_speed, "m/s");
    if (!run.stable) {
      figures += ", not stable";
    } else if (run.operational_stiffness) {
      figures += ", felt " + with_unit(*run.operational_stiffness, "N/m");
    }
    if (run.overruns > 0) figures += ", overruns " + std::to_string(run.overruns);
    if (run.share_careful > 0) {
      const double percent = 100 * run.share_careful;
      figures += ", limiter more careful " + (percent < 1 ? "< 1" : std::to_string(std::lround(percent))) + " %";
    }
    label(left(i), kMoreFigures, figures) << "tc rgb '" << kPale << "'\n";
  }

  void begin_panel(std::size_t i, std::size_t row, const std::string& title, const Scale& scale) {
    const double top = kPanelTops[row];
    out_ << "set lmargin at screen " << left(i) << "\nset rmargin at screen " << right(i) << "\n"
         << "set tmargin at screen " << top << "\nset bmargin at screen " << top - kPanelHeight << "\n"
         << "set yrange [" << scale.least << ":" << scale.most << "]\n"
         << "set key at screen " << right(i) << "," << top + kAbovePanel
         << " right center horizontal samplen 1.5 width -1.8 noenhanced textcolor rgb '" << kInk << "'\n";
    label(left(i), top + kAbovePanel, title) << "font ':Bold' tc rgb '" << kInk << "'\n";
    if (row + 1 == kPanelTops.size()) {
      out_ << "set format x '%g'\nset xlabel 'time, s' offset 0,0.4 textcolor rgb '" << kPale << "'\n";
    } else {
      out_ << "set format x ''\nunset xlabel\n";
    }
  }

  /// Draws overruns at the top, and resets the panel's settings.
  void end_panel(std::size_t i, const Scale& scale, bool named) {
    const auto& columns = drawings_[i].trace.columns();
    if (std::ranges::any_of(columns, &Trace::Column::overrun)) {
      out_ << ", $overruns" << i << " using 1:(" << scale.most << "):(0):(" << -0.08 * scale.size()
           << ") with vectors nohead lw 2 lc rgb '" << kPurple << "' " << (named ? "title 'overrun'" : "notitle");
    }
    out_ << "\nunset label\nunset object\nunset arrow\n";
  }

  void shade(const std::string& from, const std::string& to, const char* colour) {
    out_ << "set object rectangle from graph 0, " << from << " to graph 1, " << to << " behind fc rgb '" << colour
         << "' fs solid noborder\n";
  }
  void zero_line() {
    out_ << "set arrow from graph 0, first 0 to graph 1, first 0 nohead lc rgb '" << kInk << "' lw 1 back\n";
  }
  void draw_position(std::size_t i) {
    const RunSummary& run = drawings_[i].summary;
    begin_panel(i, 0, "Where the hand is, along " + axis_name(run.axis) + ", mm", position_);
    const auto shade_from = [this](double edge, const char* end) {
      std::ostringstream from;
      from << "first " << edge * 1e3;
      shade(from.str(), end, kGrey);
    };
    if (run.contact && run.contact->above) shade_from(*run.contact->above, "graph 1");
    if (run.contact && run.contact->below) shade_from(*run.contact->below, "graph 0");
    out_ << "plot $run" << i << " using 1:2 with lines lw 1.6 lc rgb '" << kInk << "' notitle";
    if (run.contact) out_ << ", keyentry with boxes fs solid noborder fc rgb '" << kGrey << "' title 'in contact'";
    end_panel(i, position_, true);
  }

  void draw_force(std::size_t i) {
    Extremes wanted;
    for (const Trace::Column& column : drawings_[i].trace.columns()) wanted.observe(column.wanted);
    const double farthest = -wanted.least > wanted.most ? wanted.least : wanted.most;
    std::string title = "Force on the hand, N";
    if (!wanted.empty() && (farthest < force_.least || farthest > force_.most))
      title += " (wanted to " + with_unit(farthest, "N") + ")";
    begin_panel(i, 1, title, force_);
    zero_line();
    out_ << "plot ";
    if (drawings_[i].summary.limiter_on) {
      out_ << "$bound" << i << " using 1:(-$2):2 with filledcurves lc rgb '" << kSky
           << "' fs solid 0.35 noborder title 'permitted', ";
    }
    out_ << "$run" << i << " using 1:3 with lines lw 1.4 lc rgb '" << kOrange << "' title 'wanted', $run" << i
         << " using 1:4 with lines lw 2 lc rgb '" << kBlue << "' title 'applied'";
    end_panel(i, force_, false);
  }

  void draw_energy(std::size_t i) {
    const Unit unit = energy_unit(energy_[i]);
    const Scale scale{energy_[i].least * unit.per_si, energy_[i].most * unit.per_si};
    std::string title = std::string("Energy put in by the hand and not yet given back, ") + unit.name;
    const double largest = std::ranges::max(energy_, {}, &Scale::size).size();
    if (largest > kTooDifferent * energy_[i].size()) title += stretched(largest / energy_[i].size());
    begin_panel(i, 2, title, scale);
    shade("graph 0", "first 0", "#fbe9de");
    zero_line();
    out_ << "set label 'below zero: given out, but never put in' at graph 0.012, graph 0.06 left front tc rgb '"
         << kVermilion << "'\n";
    out_ << "plot $run" << i << " using 1:($5 < 0 ? $5 : 0) with filledcurves y1=0 lc rgb '" << kVermilion
         << "' fs solid 0.45 noborder notitle, $run" << i << " using 1:5 with lines lw 2 lc rgb '" << kGreen
         << "' notitle";
    end_panel(i, scale, false);
  }

  std::span<const Drawing> drawings_;
  Scale position_;             ///< mm
  Scale force_;                ///< N
  std::vector<Scale> energy_;  ///< J
  double width_;               ///< pixels
  double column_;
  double span_ = 0;  ///< s
  std::ostringstream out_;
};

}  // namespace

void check_picture(const std::filesystem::path& path, std::size_t drawings) {
  if (drawings == 0 || drawings > kMostDrawings)
    throw std::invalid_argument("a picture has 1 to " + std::to_string(kMostDrawings) + " runs, got " +
                                std::to_string(drawings));
  check_picture_name(path);
}

std::size_t trace_columns(std::size_t drawings) {
  const auto n = static_cast<double>(std::max<std::size_t>(drawings, 1));
  return static_cast<std::size_t>(picture_width(drawings) / n - kLeft - kRight);
}

std::string plot_script(const std::filesystem::path& path, std::span<const Drawing> drawings) {
  check_picture(path, drawings.size());
  return Script(drawings).write(path);
}

void draw(const std::filesystem::path& path, std::span<const Drawing> drawings) {
  run_gnuplot(plot_script(path, drawings), path);
}

}  // namespace tendon::lab
