// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/surface/triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <numeric>
#include <set>
#include <span>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include "clients/softbody/fem/file_text.h"
#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/fem/places.h"
#include "clients/softbody/surface/polygon.h"
#include "clients/softbody/surface/shells.h"
#include "clients/softbody/surface/surface_file.h"

namespace tendon::softbody {
namespace {

constexpr double kTouching = 1e-9;  // relative; smaller distances are rounding errors

Vec3 twice_area(const std::array<Vec3, 3>& t) { return (t[1] - t[0]).cross(t[2] - t[0]); }

class Welded {
 public:
  explicit Welded(Facets facets) : facets_(std::move(facets)) {
    weld();
    shorten();
    drop_repeated_facets();
  }

  Triangles in_triangles(std::string_view name) {
    Triangles made{.points = std::move(facets_.points), .facets = {}, .notes = std::move(notes_)};
    for (std::size_t f = 0; f < facets_.ends.size(); ++f) {
      const std::span<const int> corners = facets_.facet(f);
      if (corners.size() == 3) {
        made.facets.push_back({corners[0], corners[1], corners[2]});
        made.numbers.push_back(numbers_[f]);
        continue;
      }
      for (const auto& [a, b, c] : cut(f, made.points, name)) {
        made.facets.push_back({corners[at(a)], corners[at(b)], corners[at(c)]});
        made.numbers.push_back(numbers_[f]);
      }
    }
    return made;
  }

 private:
  void weld() {
    std::vector<int> number(facets_.points.size(), -1);
    std::vector<Vec3> used;
    for (const int corner : facets_.corners) number[at(corner)] = 0;
    for (std::size_t i = 0; i < number.size(); ++i) {
      if (number[i] < 0) continue;
      number[i] = static_cast<int>(used.size());
      used.push_back(facets_.points[i]);
    }
    const std::vector<int> first = first_at_place(used);
    std::vector<int> kept(used.size());
    std::set<int> merged;
    facets_.points.clear();
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (first[i] == static_cast<int>(i)) {
        kept[i] = static_cast<int>(facets_.points.size());
        facets_.points.push_back(used[i]);
      } else {
        kept[i] = kept[at(first[i])];
        if (!facets_.each_by_itself) merged.insert(first[i]);
      }
    }
    for (int& corner : facets_.corners) corner = kept[at(number[at(corner)])];
    if (merged.empty()) return;
    note(counted(merged.size(), "place has", "places have") + " two points or more, which are merged, the first at " +
         in_words(used[at(*merged.begin())]));
  }

  void shorten() {
    Facets made{.points = std::move(facets_.points), .each_by_itself = facets_.each_by_itself};
    std::size_t flat = 0;
    int example = 0;
    for (std::size_t f = 0; f < facets_.ends.size(); ++f) {
      const std::size_t begin = made.corners.size();
      for (const int corner : facets_.facet(f)) {
        if (made.corners.size() == begin || made.corners.back() != corner) made.corners.push_back(corner);
      }
      while (made.corners.size() > begin + 1 && made.corners.back() == made.corners[begin]) made.corners.pop_back();
      if (made.corners.size() < begin + 3) {
        made.corners.resize(begin);
        if (++flat == 1) example = static_cast<int>(f) + 1;
        continue;
      }
      made.ends.push_back(made.corners.size());
      numbers_.push_back(static_cast<int>(f) + 1);
    }
    facets_ = std::move(made);
    if (flat > 0) {
      note(counted(flat, "facet has", "facets have") + " fewer than three different corners, and " +
           (flat == 1 ? "is" : "are") + " ignored: facet " + std::to_string(example));
    }
  }

  void drop_repeated_facets() {
    std::vector<int> turned = facets_.corners;
    for (std::size_t f = 0, begin = 0; f < facets_.ends.size(); begin = facets_.ends[f++]) {
      const auto from = turned.begin() + static_cast<std::ptrdiff_t>(begin);
      const auto to = turned.begin() + static_cast<std::ptrdiff_t>(facets_.ends[f]);
      std::rotate(from, std::min_element(from, to), to);
    }
    const auto facet = [&](std::size_t f) {
      const std::size_t begin = f == 0 ? 0 : facets_.ends[f - 1];
      return std::span(turned).subspan(begin, facets_.ends[f] - begin);
    };
    std::vector<std::size_t> order(facets_.ends.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(
        order, [&](std::size_t a, std::size_t b) { return std::ranges::lexicographical_compare(facet(a), facet(b)); });
    std::vector<std::size_t> original(order.size());
    std::size_t repeated = 0;
    for (std::size_t i = 0, first = 0; i < order.size(); ++i) {
      if (std::ranges::equal(facet(order[first]), facet(order[i]))) {
        repeated += i > first ? 1 : 0;
      } else {
        first = i;
      }
      original[order[i]] = order[first];
    }
    if (repeated == 0) return;
    Facets made{.points = std::move(facets_.points), .each_by_itself = facets_.each_by_itself};
    std::vector<int> numbers;
    std::string example;
    for (std::size_t f = 0; f < original.size(); ++f) {
      if (original[f] != f) {
        if (example.empty()) {
          example = "facet " + std::to_string(numbers_[f]) + " is facet " + std::to_string(numbers_[original[f]]);
        }
        continue;
      }
      const std::span<const int> kept = facets_.facet(f);
      made.corners.insert(made.corners.end(), kept.begin(), kept.end());
      made.ends.push_back(made.corners.size());
      numbers.push_back(numbers_[f]);
    }
    note(counted(repeated, "facet is", "facets are") + " duplicated and ignored: " + example);
    facets_ = std::move(made);
    numbers_ = std::move(numbers);
  }

  std::vector<std::array<int, 3>> cut(std::size_t f, const std::vector<Vec3>& points, std::string_view name) const {
    std::vector<Vec3> corners;
    Vec3 middle = Vec3::Zero();
    for (const int corner : facets_.facet(f)) {
      corners.push_back(points[at(corner)]);
      middle += corners.back();
    }
    const std::string who =
        "facet " + std::to_string(numbers_[f]) + " at " + in_words(middle / static_cast<double>(corners.size()));
    if (corners.size() > kMostCorners) {
      refuse_file(name, who + " has " + std::to_string(corners.size()) + " corners, expected at most " +
                            std::to_string(kMostCorners) + ": split it into smaller facets");
    }
    const Flat seen = flat(corners);
    const auto meet = sides_that_meet(seen);
    const auto triangles = meet ? std::vector<std::array<int, 3>>() : triangles_of(seen);
    if (triangles.empty()) {
      const auto [a, b] = meet.value_or(std::pair(0, 0));
      refuse_file(name, who + " is not simple: its sides that start at " + in_words(corners[at(a)]) + " and " +
                            in_words(corners[at(b)]) + " meet");
    }
    return triangles;
  }

  void note(std::string text) { notes_.push_back(std::move(text)); }

  Facets facets_;
  std::vector<int> numbers_;
  std::vector<std::string> notes_;
};

void check_edges(const Triangles& surface, std::string_view name) {
  std::map<std::pair<int, int>, std::pair<std::size_t, int>> edges;  // edge → facet and count
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto& facet = surface.facets[f];
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [known, is_new] = edges.try_emplace({facet[i], facet[(i + 1) % 3]}, f, 0);
      if (++known->second.second > 1) {
        refuse_file(name, surface.place(f) + " and " + surface.place(known->second.first) +
                              " use an edge in the same direction: one of them is turned inside out, or more than two "
                              "facets share the edge");
      }
    }
  }
  for (const auto& [edge, facet] : edges) {
    if (!edges.contains({edge.second, edge.first})) {
      refuse_file(name, surface.place(facet.first) + " has an edge without a second facet: the surface is not closed");
    }
  }
}

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

bool lie_on_each_other(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b, double rounding) {
  for (const auto& [own, other] : {std::pair(&a, &b), std::pair(&b, &a)}) {
    const Vec3 normal = twice_area(*own).normalized();
    for (const Vec3& corner : *other) {
      if (!(std::abs(normal.dot(corner - (*own)[0])) <= rounding)) return false;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const Vec3 side = (*own)[(i + 1) % 3] - (*own)[i];
      const Vec3 out = side.cross(normal).normalized();
      const double rim = out.dot((*own)[i]) - rounding;
      if (std::ranges::all_of(*other, [&](const Vec3& corner) { return out.dot(corner) >= rim; })) {
        return false;
      }
    }
  }
  return true;
}

void check_cuts(const Triangles& surface, std::string_view name) {
  const double longest = surface.longest_side();
  const double rounding = kTouching * longest;
  const Vec3 origin = box_around(surface.points).min();
  double mean = 0;
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto t = surface.corners(f);
    mean += ((t[1] - t[0]).norm() + (t[2] - t[1]).norm() + (t[0] - t[2]).norm()) / 3 /
            static_cast<double>(surface.facets.size());
  }
  const double size = std::max(2 * mean, longest / 200);
  std::unordered_map<Cell, std::vector<std::size_t>, HashOfCell> cells;
  const auto each_cell = [&](const std::array<Vec3, 3>& t, auto visit) {
    const Cell low = cell_of(t[0].cwiseMin(t[1]).cwiseMin(t[2]), origin, size);
    const Cell high = cell_of(t[0].cwiseMax(t[1]).cwiseMax(t[2]), origin, size);
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        for (std::int64_t z = low[2]; z <= high[2]; ++z) visit(Cell{x, y, z});
      }
    }
  };
  std::vector<std::size_t> seen(surface.facets.size(), surface.facets.size());
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    const auto own = surface.corners(f);
    each_cell(own, [&](const Cell& cell) {
      auto& there = cells[cell];
      for (const std::size_t other : there) {
        if (other == f || std::exchange(seen[other], f) == f) continue;
        const auto theirs = surface.corners(other);
        for (std::size_t i = 0; i < 3; ++i) {
          if (pierces(own[i], own[(i + 1) % 3], theirs, rounding) ||
              pierces(theirs[i], theirs[(i + 1) % 3], own, rounding)) {
            refuse_file(name, surface.place(f) + " and " + surface.place(other) + " intersect");
          }
        }
        if (lie_on_each_other(own, theirs, kSamePlace * longest)) {
          refuse_file(name, surface.place(other) + " and " + surface.place(f) +
                                " overlap: parts that touch must be one surface");
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

double Triangles::longest_side() const { return points.empty() ? 0 : box_around(points).sizes().maxCoeff(); }

std::array<Vec3, 3> Triangles::corners(std::size_t facet) const {
  const auto& of = facets[facet];
  return {points[at(of[0])], points[at(of[1])], points[at(of[2])]};
}

std::string Triangles::place(std::size_t facet) const {
  const auto [a, b, c] = corners(facet);
  return "facet " + std::to_string(number(facet)) + " at " + in_words((a + b + c) / 3);
}

Triangles parse_surface(std::string_view text, std::string_view ending, std::string_view name) {
  Triangles surface = Welded(read_facets(text, ending, name)).in_triangles(name);
  if (surface.facets.empty()) refuse_file(name, "has no facet");
  return surface;
}

Triangles read_surface(const std::filesystem::path& file) {
  return parse_surface(read_file(file, kMaxMeshBytes), file.extension().string(), file.string());
}

void check(const Triangles& surface, std::string_view name) {
  check_edges(surface, name);
  for (std::size_t f = 0; f < surface.facets.size(); ++f) {
    if (!(twice_area(surface.corners(f)).norm() > 0)) refuse_file(name, surface.place(f) + " has no area");
  }
  check_cuts(surface, name);
  check_shells(surface, name);
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
