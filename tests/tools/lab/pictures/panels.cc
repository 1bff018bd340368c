// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/panels.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <sstream>

#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/metadata.h"

namespace tendon::lab {
namespace {

constexpr int kPanelColumn = 800;  ///< pixels per column of panels
constexpr int kRow = 470;          ///< pixels per row of panels
constexpr int kAbovePanels = 110;  ///< pixels above the first row
constexpr std::size_t kMostPoints = 1200;
constexpr double kBeforeHeading = 64;  ///< pixels before the heading
constexpr double kBeforePanel = 72;    ///< pixels of a column before the panel
constexpr double kPanel = 696;         ///< width of a panel, pixels
constexpr double kLetter = 9.25;       ///< width that gnuplot reserves for a letter of the legend, pixels
constexpr int kSample = 7;             ///< width of the line next to a name, letters
constexpr int kKeyRow = 18;            ///< pixels for each row of the legend after the second
constexpr std::size_t kLetters = 85;   ///< per column and line below the panels
constexpr int kLine = 24;              ///< pixels

const char* words(Curve::Style style) {
  switch (style) {
    case Curve::Style::kArea:
      return "using 1:(-$2):2 with filledcurves fs solid 0.35 noborder lc rgb ";
    case Curve::Style::kPoints:
      return "using 1:2 with points pt 7 ps 0.7 lc rgb ";
    case Curve::Style::kRings:
      return "using 1:2 with points pt 6 ps 0.8 lw 1.3 lc rgb ";
    case Curve::Style::kDashed:
      return "using 1:2 with lines lw 2 dt 2 lc rgb ";
    case Curve::Style::kBold:
      return "using 1:2 with lines lw 5 lc rgb ";
    case Curve::Style::kBelow:
      return "using 1:2 with filledcurves x1 fs solid 1 noborder lc rgb ";
    case Curve::Style::kLine:
      break;
  }
  return "using 1:2 with lines lw 1.6 lc rgb ";
}

/// Additional height in pixels for the legend with the most rows. All columns are as wide as the longest name.
int room_for_keys(const std::vector<Panel>& panels) {
  int rows = 2;
  for (const Panel& panel : panels) {
    int names = 0;
    std::ptrdiff_t longest = 0;
    for (const Curve& curve : panel.curves) {
      if (curve.name.empty() || curve.points.empty()) continue;
      ++names;
      longest = std::max(longest, std::ranges::count_if(curve.name, [](char c) { return (c & 0xC0) != 0x80; }));
    }
    const auto columns = static_cast<int>(kPanel / (kLetter * static_cast<double>(longest + kSample)));
    rows = std::max(rows, (names - 1) / std::max(columns, 1) + 1);
  }
  return kKeyRow * (rows - 2);
}

void range(std::ostream& out, char axis, const std::optional<std::pair<double, double>>& range) {
  out << "set " << axis << "range [";
  if (range) {
    out << range->first << ":" << range->second;
  } else {
    out << "*:*";
  }
  out << "]\n";
}

/// gnuplot labels only powers of ten, of which a short logarithmic axis may contain none.
void ticks(std::ostream& out, const Panel& panel) {
  constexpr double kShort = 30;
  if (!panel.log_x || !panel.x_range || panel.x_range->second > kShort * panel.x_range->first) {
    out << "set xtics autofreq\n";
    return;
  }
  const char* separator = "set xtics (";
  for (double power = std::pow(10, std::floor(std::log10(panel.x_range->first))); power < panel.x_range->second;
       power *= 10) {
    for (const double one : {1.0, 2.0, 3.0, 5.0, 7.0}) {
      out << separator << one * power;
      separator = ", ";
    }
  }
  out << ")\n";
}

/// At the right end of the panel labels go below and to the left. Returns those points, or all others.
std::vector<std::size_t> labels_at(const Panel& panel, const Curve& curve, bool right_end) {
  constexpr double kRightEnd = 0.7;  // fraction of the panel's width; a label needs up to 0.3
  const auto along = [&](double x) { return panel.log_x ? std::log(x) : x; };
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < curve.labels.size(); ++i) {
    double share = 0;
    if (panel.x_range) {
      const auto [least, most] = *panel.x_range;
      share = (along(curve.points.at(i).first) - along(least)) / (along(most) - along(least));
    }
    if (!curve.labels[i].empty() && (share > kRightEnd) == right_end) found.push_back(i);
  }
  return found;
}

/// Breaks paragraphs at spaces, and words that are longer than a line after `letters`.
std::vector<std::string> lines_of(const std::vector<std::string>& paragraphs, std::size_t letters) {
  std::vector<std::string> lines;
  for (std::string rest : paragraphs) {
    while (rest.size() > letters) {
      const std::size_t space = rest.rfind(' ', letters);
      const bool found = space != std::string::npos && space > 0;
      lines.push_back(rest.substr(0, found ? space : letters));
      rest = rest.substr(found ? space + 1 : letters);
    }
    lines.push_back(rest);
  }
  return lines;
}

}  // namespace

std::vector<std::pair<double, double>> thinned(const std::vector<std::pair<double, double>>& points) {
  if (points.size() <= kMostPoints) return points;
  const std::size_t stretch = points.size() / (kMostPoints / 2) + 1;
  std::vector<std::pair<double, double>> result;
  for (std::size_t i = 0; i < points.size(); i += stretch) {
    const auto begin = points.begin() + static_cast<std::ptrdiff_t>(i);
    const auto end = points.begin() + static_cast<std::ptrdiff_t>(std::min(i + stretch, points.size()));
    auto [least, most] = std::minmax_element(begin, end, [](auto& a, auto& b) { return a.second < b.second; });
    if (least->first > most->first) std::swap(least, most);
    result.push_back(*least);
    if (least != most) result.push_back(*most);
  }
  return result;
}

std::string panels_script(const std::filesystem::path& path, const std::string& heading, const std::string& figures,
                          const std::vector<Panel>& panels, const std::vector<std::string>& below, int columns) {
  check_picture_name(path);
  const auto in_row = static_cast<std::size_t>(columns);
  const std::size_t rows = (panels.size() + in_row - 1) / in_row;
  const int width = kPanelColumn * columns;
  const int keys = room_for_keys(panels);
  const int end_of_panels = kAbovePanels + (kRow + keys) * static_cast<int>(rows);
  const std::vector<std::string> lines = lines_of(below, kLetters * in_row);
  const int height = end_of_panels + kLine * static_cast<int>(lines.size());
  std::ostringstream out;
  out << begin_picture(path, width, height) << "set border 3 lc rgb '" << kPale << "'\n"
      << "set tics nomirror out scale 0.6 textcolor rgb '" << kPale << "'\n"
      << "set grid ytics lc rgb '#e4e4e4' lt 1 lw 1\n";
  for (std::size_t p = 0; p < panels.size(); ++p) {
    for (std::size_t c = 0; c < panels[p].curves.size(); ++c) {
      out << "$d" << p << "_" << c << " << EOD\n";
      for (const auto& [x, y] : thinned(panels[p].curves[c].points)) {
        if (std::isfinite(x) && std::isfinite(y)) out << x << " " << y << "\n";
      }
      out << "EOD\n";
      for (const bool right_end : {false, true}) {
        const auto labels = labels_at(panels[p], panels[p].curves[c], right_end);
        if (labels.empty()) continue;
        out << (right_end ? "$r" : "$l") << p << "_" << c << " << EOD\n";
        for (const std::size_t i : labels) {
          const auto& [x, y] = panels[p].curves[c].points.at(i);
          out << x << " " << y << " \"" << panels[p].curves[c].labels[i] << "\"\n";
        }
        out << "EOD\n";
      }
    }
  }
  const auto up = [height](double pixels_from_top) { return 1 - pixels_from_top / height; };
  out << "set multiplot\n";
  out << "set label " << literal(heading) << " at screen " << kBeforeHeading / width << "," << up(34)
      << " noenhanced font ':Bold,20' tc rgb '" << kInk << "'\n";
  out << "set label " << literal(figures) << " at screen " << kBeforeHeading / width << "," << up(70)
      << " noenhanced tc rgb '" << kPale << "'\n";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    out << "set label " << literal(lines[i]) << " at screen " << kBeforeHeading / width << ","
        << up(end_of_panels + kLine * static_cast<double>(i)) << " noenhanced tc rgb '" << kPale << "'\n";
  }
  for (std::size_t p = 0; p < panels.size(); ++p) {
    const Panel& panel = panels[p];
    const double left = (kPanelColumn * static_cast<double>(p % in_row) + kBeforePanel) / width;
    const double right = left + kPanel / width;
    const std::size_t row = p / in_row;
    const double top = kAbovePanels + static_cast<double>(row) * (kRow + keys) + keys + 74;
    out << "set lmargin at screen " << left << "\nset rmargin at screen " << right << "\nset tmargin at screen "
        << up(top) << "\nset bmargin at screen " << up(top + kRow - 144) << "\n";
    out << "set label " << literal(panel.title) << " at screen " << left << "," << up(top - keys - 54)
        << " noenhanced font ':Bold' tc rgb '" << kInk << "'\n";
    out << "set key at screen " << right << "," << up(top - keys / 2.0 - 20)
        << " right center horizontal samplen 1.5 noenhanced textcolor rgb '" << kInk << "'\n";
    out << "set xlabel " << literal(panel.x_label) << " noenhanced offset 0,0.4 textcolor rgb '" << kPale << "'\n";
    out << (panel.log_x ? "set logscale x\n" : "unset logscale x\n")
        << (panel.log_y ? "set logscale y\n" : "unset logscale y\n");
    ticks(out, panel);
    range(out, 'x', panel.x_range);
    range(out, 'y', panel.y_range);
    const char* separator = "plot ";
    for (std::size_t c = 0; c < panel.curves.size(); ++c) {
      const Curve& curve = panel.curves[c];
      if (curve.points.empty()) continue;
      out << separator << "$d" << p << "_" << c << " " << words(curve.style) << "'" << curve.colour << "' "
          << (curve.name.empty() ? "notitle" : "title " + literal(curve.name));
      separator = ", ";
      for (const bool right_end : {false, true}) {
        if (labels_at(panel, curve, right_end).empty()) continue;
        out << (right_end ? ", $r" : ", $l") << p << "_" << c << " using 1:2:3 with labels "
            << (right_end ? "right offset 0.5,-0.8" : "left offset 0.7,0.5") << " font ',9' noenhanced tc rgb '" << kInk
            << "' notitle";
      }
    }
    out << "\nunset label\n";
  }
  out << "unset multiplot\nunset output\n";
  return out.str();
}

std::vector<std::filesystem::path> draw_panels(const std::filesystem::path& stem, const std::string& heading,
                                               const std::string& figures, const std::vector<Panel>& panels,
                                               const std::string& command, const std::vector<std::string>& below,
                                               int columns) {
  std::vector<std::string> paragraphs = below;
  paragraphs.insert(paragraphs.begin(), command);
  std::vector<std::filesystem::path> files;
  for (const char* const extension : {".svg", ".png"}) {
    std::filesystem::path file = stem;
    file += extension;
    run_gnuplot(panels_script(file, heading, figures, panels, paragraphs, columns), file);
    add_metadata(file, "Description", command + "; " + figures);
    files.push_back(file);
  }
  return files;
}

}  // namespace tendon::lab
