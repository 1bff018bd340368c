// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "clients/softbody/fem/file_text.h"
#include "clients/softbody/fem/gmsh.h"

namespace tendon::softbody {
namespace {

constexpr double kSame = 1e-6;      // of the longest side: two points are one
constexpr double kTouching = 1e-9;  // of the same: less is rounding

[[noreturn]] void refuse(std::string_view name, const std::string& what) {
  throw std::invalid_argument(std::string(name) + ": " + what);
}

/// "facet 7 at (1, 2, 3)"
std::string place(const Triangles& surface, std::size_t facet) {
  Vec3 middle = Vec3::Zero();
  for (const int corner : surface.facets[facet]) middle += surface.points[at(corner)] / 3;
  const auto text = [](double value) {
    std::array<char, 32> digits{};
    return std::string(
        digits.data(),
        std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 4).ptr);
  };
  return "facet " + std::to_string(facet + 1) + " at (" + text(middle.x()) + ", " + text(middle.y()) + ", " +
         text(middle.z()) + ")";
}

Vec3 twice_area(const Triangles& surface, const std::array<int, 3>& facet) {
  const Vec3& a = surface.points[at(facet[0])];
  return (surface.points[at(facet[1])] - a).cross(surface.points[at(facet[2])] - a);
}

/// SurfaceWords of a text, line by line.
class SurfaceWords {
 public:
  SurfaceWords(std::string_view text, std::string_view name) : rest_(text), name_(name) {}

  /// The words of the next line that has some; empty at the end. Anything after '#' is left out.
  const std::vector<std::string_view>& next() {
    words_.clear();
    while (words_.empty() && !rest_.empty()) {
      ++line_;
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      std::string_view line = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      line = line.substr(0, line.find('#'));
      while (!line.empty()) {
        const std::size_t begin = line.find_first_not_of(" \t\r\v\f");
        if (begin == std::string_view::npos) break;
        line.remove_prefix(begin);
        const std::size_t size = std::min(line.find_first_of(" \t\r\v\f"), line.size());
        words_.push_back(line.substr(0, size));
        line.remove_prefix(size);
      }
    }
    return words_;
  }
  [[noreturn]] void fail(const std::string& what) const {
    refuse(name_, "line " + std::to_string(line_) + ": " + what);
  }
  double number(std::string_view word) const {
    double value = 0;
    const auto [end, error] =
        std::from_chars(word.data() + (word.starts_with('+') ? 1 : 0), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      fail("expected a number, found \"" + std::string(word) + '"');
    }
    return value;
  }
  long whole(std::string_view word) const {
    long value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      fail("expected a whole number, found \"" + std::string(word) + '"');
    }
    return value;
  }
  Vec3 point(std::size_t from) const {
    if (words_.size() < from + 3) fail("expected three numbers");
    return {number(words_[from]), number(words_[from + 1]), number(words_[from + 2])};
  }

 private:
  std::string_view rest_;
  std::string_view name_;
  std::size_t line_ = 0;
  std::vector<std::string_view> words_;
};

/// Triangles around the first corner.
void add_polygon(Triangles& surface, const std::vector<int>& corners) {
  for (std::size_t i = 2; i < corners.size(); ++i) surface.facets.push_back({corners[0], corners[i - 1], corners[i]});
}

void add_facet(Triangles& surface, const std::array<Vec3, 3>& corners) {
  const int first = static_cast<int>(surface.points.size());
  surface.points.insert(surface.points.end(), corners.begin(), corners.end());
  surface.facets.push_back({first, first + 1, first + 2});
}

constexpr std::size_t kStlHead = 84;
constexpr std::size_t kStlFacet = 50;

Triangles read_binary_stl(std::string_view bytes, std::string_view name) {
  static_assert(std::endian::native == std::endian::little, "STL is little-endian");
  Triangles surface;
  for (std::size_t from = kStlHead; from < bytes.size(); from += kStlFacet) {
    std::array<float, 9> numbers{};
    std::memcpy(numbers.data(), bytes.data() + from + 12, sizeof numbers);
    if (!std::ranges::all_of(numbers, [](float number) { return std::isfinite(number); })) {
      refuse(name, "facet " + std::to_string((from - kStlHead) / kStlFacet + 1) + ": a number is not finite");
    }
    std::array<Vec3, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) corners[i] = Vec3(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
    add_facet(surface, corners);
  }
  return surface;
}

Triangles read_stl(std::string_view text, std::string_view name) {
  if (text.size() >= kStlHead) {
    std::uint32_t count = 0;
    std::memcpy(&count, text.data() + 80, sizeof count);
    if (text.size() == kStlHead + std::uint64_t{kStlFacet} * count) return read_binary_stl(text, name);
  }
  Triangles surface;
  SurfaceWords words(text, name);
  if (const auto& first = words.next(); first.empty() || first[0] != "solid") {
    refuse(name, "expected an STL file: text that begins with \"solid\", or 84 bytes and 50 for each facet");
  }
  std::vector<Vec3> corners;
  for (const auto* line = &words.next(); !line->empty(); line = &words.next()) {
    if ((*line)[0] == "vertex") corners.push_back(words.point(1));
    if ((*line)[0] == "endloop") {
      if (corners.size() != 3) words.fail("expected three corners, found " + std::to_string(corners.size()));
      add_facet(surface, {corners[0], corners[1], corners[2]});
      corners.clear();
    }
  }
  if (!corners.empty()) refuse(name, "ends within a facet");
  return surface;
}

Triangles read_obj(std::string_view text, std::string_view name) {
  Triangles surface;
  SurfaceWords words(text, name);
  std::vector<int> corners;
  for (const auto* line = &words.next(); !line->empty(); line = &words.next()) {
    if ((*line)[0] == "v") surface.points.push_back(words.point(1));
    if ((*line)[0] != "f") continue;
    if (line->size() < 4) words.fail("expected three corners or more");
    corners.clear();
    for (std::size_t i = 1; i < line->size(); ++i) {
      const std::string_view word = (*line)[i];
      const long number = words.whole(word.substr(0, word.find('/')));
      const auto count = static_cast<long>(surface.points.size());
      const long index = number < 0 ? count + number : number - 1;  // from the end, or from 1
      if (index < 0 || index >= count) words.fail("there is no vertex " + std::string(word));
      corners.push_back(static_cast<int>(index));
    }
    add_polygon(surface, corners);
  }
  return surface;
}

Triangles read_off(std::string_view text, std::string_view name) {
  Triangles surface;
  SurfaceWords words(text, name);
  const auto* line = &words.next();
  if (line->empty() || (*line)[0] != "OFF") refuse(name, "expected an OFF file, which begins with \"OFF\"");
  if (line->size() == 1) line = &words.next();
  if (line->size() < 2) words.fail("expected the numbers of points and facets");
  const bool same_line = (*line)[0] == "OFF";
  const long points = words.whole((*line)[same_line ? 1 : 0]);
  const long facets = words.whole(line->at(same_line ? 2 : 1));
  if (points < 0 || facets < 0) words.fail("expected numbers of points and facets that are not below 0");
  for (long i = 0; i < points; ++i) {
    if (words.next().empty()) refuse(name, "ends after " + std::to_string(i) + " points of " + std::to_string(points));
    surface.points.push_back(words.point(0));
  }
  std::vector<int> corners;
  for (long i = 0; i < facets; ++i) {
    line = &words.next();
    if (line->empty()) refuse(name, "ends after " + std::to_string(i) + " facets of " + std::to_string(facets));
    const long count = words.whole((*line)[0]);
    if (count < 3 || static_cast<std::size_t>(count) >= line->size()) words.fail("expected three corners or more");
    corners.clear();
    for (long c = 1; c <= count; ++c) {
      const long index = words.whole((*line)[static_cast<std::size_t>(c)]);
      if (index < 0 || index >= points) words.fail("there is no point " + std::to_string(index));
      corners.push_back(static_cast<int>(index));
    }
    add_polygon(surface, corners);
  }
  return surface;
}

/// Points by cells of a grid.
using Cell = std::array<std::int64_t, 3>;
struct HashOfCell {
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = 0;
    for (const std::int64_t along : cell) hash = (hash ^ static_cast<std::uint64_t>(along)) * 0x9E3779B97F4A7C15ULL;
    return hash ^ hash >> 32U;
  }
};
Cell cell_of(const Vec3& point, double size) {
  Cell cell{};
  for (int i = 0; i < 3; ++i) cell[at(i)] = static_cast<std::int64_t>(std::floor(point[i] / size));
  return cell;
}

template <class Visit>
void visit_around(const Cell& middle, Visit visit) {
  for (std::int64_t x = -1; x <= 1; ++x) {
    for (std::int64_t y = -1; y <= 1; ++y) {
      for (std::int64_t z = -1; z <= 1; ++z) visit(Cell{middle[0] + x, middle[1] + y, middle[2] + z});
    }
  }
}

Triangles welded(const Triangles& all) {
  const double near = kSame * all.longest_side();
  Triangles kept;
  std::vector<int> number(all.points.size());
  std::unordered_map<Cell, std::vector<int>, HashOfCell> cells;
  for (std::size_t i = 0; i < all.points.size(); ++i) {
    const Vec3& point = all.points[i];
    const Cell own = cell_of(point, near);
    int same = -1;
    visit_around(own, [&](const Cell& cell) {
      const auto found = cells.find(cell);
      if (same >= 0 || found == cells.end()) return;
      for (const int candidate : found->second) {
        if ((kept.points[at(candidate)] - point).norm() <= near) same = candidate;
      }
    });
    if (same < 0) {
      same = static_cast<int>(kept.points.size());
      kept.points.push_back(point);
      cells[own].push_back(same);
    }
    number[i] = same;
  }
  for (const auto& facet : all.facets) {
    const std::array<int, 3> corners{number[at(facet[0])], number[at(facet[1])], number[at(facet[2])]};
    if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0])
      kept.facets.push_back(corners);
  }
  return kept;
}

void check_edges(const Triangles& surface, std::string_view name) {
  std::map<std::pair<int, int>, std::pair<std::size_t, int>> edges;  // from, to: a facet, and how many
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto& facet = surface.facets[f];
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [known, is_new] = edges.try_emplace({facet[i], facet[(i + 1) % 3]}, f, 0);
      if (++known->second.second > 1) {
        refuse(name, place(surface, f) + " and " + place(surface, known->second.first) +
                         " run along an edge in the same direction: one of them is turned inside out, or more than two "
                         "facets meet there");
      }
    }
  }
  for (const auto& [edge, facet] : edges) {
    if (!edges.contains({edge.second, edge.first})) {
      refuse(name, place(surface, facet.first) + " has an edge that no other facet has: the surface is not closed");
    }
  }
}

/// Whether the open segment a–b goes through the triangle, and not along it.
bool pierces(const Vec3& a, const Vec3& b, const std::array<Vec3, 3>& t, double rounding) {
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
  const double from = normal.dot(a - t[0]);
  const double to = normal.dot(b - t[0]);
  if (!(from * to < 0) || std::min(std::abs(from), std::abs(to)) <= rounding) return false;
  const Vec3 hit = a + from / (from - to) * (b - a);
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 side = t[(i + 1) % 3] - t[i];
    if (normal.dot(side.cross(hit - t[i])) <= rounding * side.norm()) return false;
  }
  return true;
}

void check_cuts(const Triangles& surface, std::string_view name) {
  const double rounding = kTouching * surface.longest_side();
  const auto corners_of = [&](std::size_t f) {
    const auto& facet = surface.facets[f];
    return std::array{surface.points[at(facet[0])], surface.points[at(facet[1])], surface.points[at(facet[2])]};
  };
  double mean = 0;
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto t = corners_of(f);
    mean += ((t[1] - t[0]).norm() + (t[2] - t[1]).norm() + (t[0] - t[2]).norm()) / 3 /
            static_cast<double>(surface.facets.size());
  }
  // A grid of cells as large as a facet; one that is larger lies in many.
  const double size = std::max(2 * mean, surface.longest_side() / 200);
  std::unordered_map<Cell, std::vector<std::size_t>, HashOfCell> cells;
  const auto each_cell = [&](const std::array<Vec3, 3>& t, auto visit) {
    const Cell low = cell_of(t[0].cwiseMin(t[1]).cwiseMin(t[2]), size);
    const Cell high = cell_of(t[0].cwiseMax(t[1]).cwiseMax(t[2]), size);
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z) visit(Cell{x, y, z});
      }
    }
  };
  std::vector<std::size_t> seen(surface.facets.size(), surface.facets.size());
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto own = corners_of(f);
    each_cell(own, [&](const Cell& cell) {
      auto& there = cells[cell];
      for (const std::size_t other : there) {
        if (other == f || std::exchange(seen[other], f) == f) continue;
        const auto theirs = corners_of(other);
        for (std::size_t i = 0; i < 3; ++i) {
          if (pierces(own[i], own[(i + 1) % 3], theirs, rounding) ||
              pierces(theirs[i], theirs[(i + 1) % 3], own, rounding)) {
            refuse(name, place(surface, f) + " and " + place(surface, other) + " cut each other");
          }
        }
      }
      there.push_back(f);
    });
  }
}

}  // namespace

double Triangles::volume() const {
  if (points.empty()) return 0;
  double six = 0;
  for (const auto& facet : facets) {
    const Vec3 a = points[at(facet[0])] - points[0];
    six += a.dot((points[at(facet[1])] - points[0]).cross(points[at(facet[2])] - points[0]));
  }
  return six / 6;
}

double Triangles::longest_side() const {
  if (points.empty()) return 0;
  Vec3 low = points.front();
  Vec3 high = low;
  for (const Vec3& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  return (high - low).maxCoeff();
}

Triangles parse_surface(std::string_view text, std::string_view ending, std::string_view name) {
  std::string lower(ending);
  std::ranges::transform(lower, lower.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  Triangles all;
  if (lower == ".stl") {
    all = read_stl(text, name);
  } else if (lower == ".obj") {
    all = read_obj(text, name);
  } else if (lower == ".off") {
    all = read_off(text, name);
  } else {
    refuse(name, "expected a surface: a file .stl, .obj or .off");
  }
  Triangles surface = welded(all);
  if (surface.facets.empty()) refuse(name, "has no facet");
  return surface;
}

Triangles read_surface(const std::filesystem::path& file) {
  return parse_surface(read_file(file, kMaxMeshBytes), file.extension().string(), file.string());
}

void check(const Triangles& surface, std::string_view name) {
  check_edges(surface, name);
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    if (!(twice_area(surface, surface.facets[f]).norm() > 0)) refuse(name, place(surface, f) + " has no area");
  }
  check_cuts(surface, name);
  if (!(surface.volume() > 0)) {
    refuse(name, "the surface is turned inside out: its facets must run anticlockwise, seen from outside");
  }
}

void write_stl(const std::filesystem::path& file, const Triangles& surface) {
  std::string bytes(kStlHead, '\0');
  const auto count = static_cast<std::uint32_t>(surface.facets.size());
  std::memcpy(bytes.data() + 80, &count, sizeof count);
  for (const auto& facet : surface.facets) {
    std::array<float, 12> numbers{};
    for (std::size_t i = 0; i < 3; ++i) {
      for (int c = 0; c < 3; ++c) {
        numbers[3 + 3 * i + at(c)] = static_cast<float>(surface.points[at(facet[i])][c]);
      }
    }
    bytes.append(reinterpret_cast<const char*>(numbers.data()), sizeof numbers).append(2, '\0');
  }
  std::ofstream out(file, std::ios::binary);
  out << bytes;
  if (!out.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace tendon::softbody
