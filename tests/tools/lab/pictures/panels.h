// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tendon::lab {

struct Curve {
  enum class Style {
    kLine,
    kDashed,
    kArea,  ///< between −y and y
    kPoints,
    kRings,
    kBold,   ///< emphasized line
    kBelow,  ///< between the x axis and y
  };
  std::string name;
  const char* colour;  ///< a color of gnuplot.h
  std::vector<std::pair<double, double>> points = {};
  Style style = Style::kLine;
  std::vector<std::string> labels = {};  ///< empty, or one per point
};

struct Panel {
  std::string title;
  std::string x_label;
  std::vector<Curve> curves = {};
  std::optional<std::pair<double, double>> x_range = std::nullopt;
  std::optional<std::pair<double, double>> y_range = std::nullopt;
  bool log_x = false;
  bool log_y = false;
};

/// Minimum and maximum of each interval of points sorted by x, at the resolution of a panel.
std::vector<std::pair<double, double>> thinned(const std::vector<std::pair<double, double>>& points);

/// Returns a gnuplot script that draws the panels in rows of `columns`, with a heading, a line of figures, and the paragraphs
/// `below` them, which are wrapped.
std::string panels_script(const std::filesystem::path& path, const std::string& heading, const std::string& figures,
                          const std::vector<Panel>& panels, const std::vector<std::string>& below = {},
                          int columns = 2);

/// Writes `stem`.svg and `stem`.png and returns their names. The command is written below the panels, and to the metadata
/// of the files together with the `figures`. Throws the exceptions of `run_gnuplot` and `add_metadata`.
std::vector<std::filesystem::path> draw_panels(const std::filesystem::path& stem, const std::string& heading,
                                               const std::string& figures, const std::vector<Panel>& panels,
                                               const std::string& command, const std::vector<std::string>& below = {},
                                               int columns = 2);

}  // namespace tendon::lab
