// SPDX-License-Identifier: Apache-2.0
// Tests that the labels of each figure are inside of the picture, and that the figure contains the command.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/tools/bench/chart.h"
#include "tests/tools/lab/experiments/accuracy.h"
#include "tests/tools/lab/experiments/boundary.h"
#include "tests/tools/lab/experiments/candidate.h"
#include "tests/tools/lab/experiments/compare.h"
#include "tests/tools/lab/experiments/cost.h"
#include "tests/tools/lab/experiments/field.h"
#include "tests/tools/lab/experiments/netem.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/lab/experiments/teleop.h"
#include "tests/tools/lab/grid/zwidth.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab::labels_test {
namespace {

std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The pixels of a PNG file of gnuplot: 8 bits, RGB or RGBA, not interlaced (PNG 1.2, sections 4 and 6).
class Pixels {
 public:
  explicit Pixels(const std::string& png) {
    const auto number = [&png](std::size_t at) {
      std::size_t value = 0;
      for (std::size_t i = 0; i < 4; ++i) value = value << 8U | static_cast<unsigned char>(png.at(at + i));
      return value;
    };
    constexpr std::size_t kHeader = 16;
    width_ = number(kHeader);
    height_ = number(kHeader + 4);
    const char colour_type = png.at(kHeader + 9);
    if (png.at(kHeader + 8) != 8 || (colour_type != 2 && colour_type != 6)) throw std::runtime_error("another PNG");
    channels_ = colour_type == 2 ? 3 : 4;
    std::string packed;
    for (std::size_t at = 8; at + 12 <= png.size(); at += 12 + number(at)) {
      if (png.compare(at + 4, 4, "IDAT") == 0) packed += png.substr(at + 8, number(at));
    }
    const std::size_t row = 1 + width_ * channels_;
    bytes_.resize(height_ * row);
    uLongf size = bytes_.size();
    if (uncompress(bytes_.data(), &size, reinterpret_cast<const Bytef*>(packed.data()), packed.size()) != Z_OK ||
        size != bytes_.size()) {
      throw std::runtime_error("a damaged PNG");
    }
    for (std::size_t y = 0; y < height_; ++y) unfilter(y * row, row);
  }

  std::size_t width() const { return width_; }
  std::size_t height() const { return height_; }
  bool white(std::size_t x, std::size_t y) const {
    const std::size_t at = y * (1 + width_ * channels_) + 1 + x * channels_;
    return std::all_of(bytes_.begin() + static_cast<std::ptrdiff_t>(at),
                       bytes_.begin() + static_cast<std::ptrdiff_t>(at) + 3, [](unsigned char c) { return c == 255; });
  }

 private:
  void unfilter(std::size_t begin, std::size_t row) {
    const unsigned char filter = bytes_[begin];
    for (std::size_t i = 1; i < row; ++i) {
      const int left = i > channels_ ? bytes_[begin + i - channels_] : 0;
      const int up = begin > 0 ? bytes_[begin - row + i] : 0;
      const int corner = begin > 0 && i > channels_ ? bytes_[begin - row + i - channels_] : 0;
      const int guess = left + up - corner;
      const int nearest = std::abs(guess - left) <= std::min(std::abs(guess - up), std::abs(guess - corner)) ? left
                          : std::abs(guess - up) <= std::abs(guess - corner)                                 ? up
                                                                                                             : corner;
      const std::array<int, 5> before = {0, left, up, (left + up) / 2, nearest};
      bytes_[begin + i] = static_cast<unsigned char>(bytes_[begin + i] + before.at(filter));
    }
  }

  std::size_t width_ = 0;
  std::size_t height_ = 0;
  std::size_t channels_ = 0;
  std::vector<unsigned char> bytes_{};
};

/// Returns the edges of the picture that contain a pixel that is not white.
std::string cut_edges(const Pixels& pixels) {
  constexpr std::size_t kFrame = 4;  // pixels; wider than the gap between two letters
  std::string edges;
  const auto look = [&](const char* name, std::size_t x0, std::size_t x1, std::size_t y0, std::size_t y1) {
    for (std::size_t y = y0; y < y1; ++y) {
      for (std::size_t x = x0; x < x1; ++x) {
        if (pixels.white(x, y)) continue;
        edges += (edges.empty() ? "" : ", ") + std::string(name) + " at " + std::to_string(x) + "," + std::to_string(y);
        return;
      }
    }
  };
  const std::size_t w = pixels.width();
  const std::size_t h = pixels.height();
  look("left", 0, kFrame, 0, h);
  look("right", w - kFrame, w, 0, h);
  look("top", 0, w, 0, kFrame);
  look("bottom", 0, w, h - kFrame, h);
  return edges;
}

constexpr const char* kCommand = "tendon-lab verb --with options";
const std::string kLong =
    "tendon-lab sweep deploy/scenes/demo.toml --network 'base={0,3,8,18,28,38,48,73,98}ms "
    "delay=gamma(2ms,1ms) memory=20ms loss=burst(1%,3)' --stiffness 62,125,177,250,354,500,707";

struct Figure {
  const char* name;
  std::function<void(const std::filesystem::path& folder)> draw;
};
void PrintTo(const Figure& figure, std::ostream* out) { *out << figure.name; }

class Labels : public ::testing::TestWithParam<Figure> {};

TEST_P(Labels, StayInsideOfEachPicture) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / ("labels-" + std::string(GetParam().name));
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  GetParam().draw(folder);
  std::size_t pictures = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string bytes = bytes_of(entry.path());
    if (entry.path().extension() == ".png") {
      ++pictures;
      EXPECT_EQ(cut_edges(Pixels(bytes)), "") << entry.path();
      EXPECT_NE(bytes.find("iTXtDescription"), std::string::npos) << entry.path();
    }
    EXPECT_NE(bytes.find("tendon-lab"), std::string::npos) << entry.path();
  }
  EXPECT_GT(pictures, 0U);
}

std::ostringstream nowhere;

INSTANTIATE_TEST_SUITE_P(
    Pictures, Labels,
    ::testing::Values(
        Figure{"boundary", [](const auto& folder) { boundary({.out = folder, .command = kCommand}, nowhere); }},
        Figure{"netem",
               [](const auto& folder) { netem({.count = 2000, .out = folder, .command = kCommand}, nowhere); }},
        Figure{"cost", [](const auto& folder) { cost({.batches = 1, .out = folder, .command = kCommand}, nowhere); }},
        Figure{"compare",
               [](const auto& folder) { compare({.every = 331, .out = folder, .command = kCommand}, nowhere); }},
        Figure{"paper", [](const auto& folder) { paper({.out = folder, .command = kCommand}, nowhere); }},
        Figure{"teleop", [](const auto& folder) { teleop({.hands = 1, .out = folder, .command = kCommand}, nowhere); }},
        Figure{"field",
               [](const auto& folder) {
                 FieldOptions options{.hands = 1, .round_trips_ms = {0, 600}, .out = folder, .command = kCommand};
                 field_experiment(options, nowhere);
                 options.far = true;
                 field_experiment(options, nowhere);
               }},
        Figure{"accuracy",
               [](const auto& folder) {
                 AccuracyOptions options;
                 options.models = {*any_model_named("condensed"), *any_model_named("linear")};
                 options.resolutions = {2, 3};
                 options.truth.cells = 2;
                 options.errors_only = true;
                 options.out = folder;
                 options.command = kCommand;
                 accuracy(options, nowhere);
               }},
        Figure{"zwidth",
               [](const auto& folder) {
                 std::vector<GridRow> rows;
                 for (const std::string law :
                      {"none", "aol", "energy-bounding", "nonlinear-coupling", "feel-unconditional"}) {
                   for (const double delay : {0.01, 0.2}) {
                     rows.push_back({.cell = {.law = law, .network = std::to_string(delay), .stiffness = 4000},
                                     .measured = {.round_trip = delay,
                                                  .felt_stiffness = 1e4,
                                                  .least_energy = law == "aol" ? -1e-6 : 0,
                                                  .vibration = 0}});
                   }
                 }
                 draw_zwidth(folder / "zwidth", rows, {}, {kLong, std::string(64, 'a'), "c0ffee", "f00d"});
               }},
        Figure{"bench",
               [](const auto& folder) {
                 std::vector<bench::Row> rows;
                 for (const double devices : {16, 1024}) {
                   bench::Row& row = rows.emplace_back();
                   row.what = "states and forces at 1 kHz";
                   row.p50 = 100 * devices;
                   row.figures = {{"devices", devices}, {"haptic_us", devices}, {"answered_in_time_percent", 100}};
                 }
                 bench::Circumstances here;
                 here.command = kLong;
                 bench::draw_devices(folder / "devices", here, rows);
               }}),
    [](const auto& of) { return of.param.name; });

TEST(LabelsTest, ALabelThatIsCutIsFound) {
  const auto stem = std::filesystem::path(::testing::TempDir()) / "cut";
  draw_panels(stem, std::string(200, 'M'), "figures",
              {{.title = "a", .x_label = "b", .curves = {{"c", "#000000", {{0, 0}, {1, 1}}}}}}, kCommand);
  EXPECT_NE(cut_edges(Pixels(bytes_of(stem.string() + ".png"))).find("right at "), std::string::npos);
}

}  // namespace
}  // namespace tendon::lab::labels_test
