// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace tendon::lab {

/// Values over values, to be drawn.
struct Curve {
  enum class Style {
    kLine,
    kDashed,
    kArea,  ///< between −y and y
    kPoints,
    kRings,
    kBold,   ///< a line that matters more than the others
    kBelow,  ///< between the x axis and y
  };
  std::string name;
  const char* colour;  ///< one of gnuplot.h
  std::vector<std::pair<double, double>> points = {};
  Style style = Style::kLine;
  std::vector<std::string> labels = {};  ///< one beside each point, or none
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

/// Of points in the order of x, as many as a panel can show: the least and the most of every stretch.
std::vector<std::pair<double, double>> thinned(const std::vector<std::pair<double, double>>& points);

/// What gnuplot is told to draw `panels`, two in a row, under a heading and a line of figures.
std::string panels_script(const std::filesystem::path& path, const std::string& heading, const std::string& figures,
                          const std::vector<Panel>& panels);

/// Draws it as `stem`.svg and `stem`.png and returns their names. Throws what `run_gnuplot` throws.
std::vector<std::filesystem::path> draw_panels(const std::filesystem::path& stem, const std::string& heading,
                                               const std::string& figures, const std::vector<Panel>& panels);

}  // namespace tendon::lab
