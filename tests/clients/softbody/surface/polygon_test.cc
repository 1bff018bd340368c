// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/surface/polygon.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/dice.h"
#include "tests/support/property_cases.h"

namespace tendon::softbody::polygon_test {
namespace {

double area(const Flat& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i] - polygon[0];
    const Eigen::Vector2d b = polygon[(i + 1) % polygon.size()] - polygon[0];
    twice += a.x() * b.y() - a.y() * b.x();
  }
  return twice / 2;
}

/// Returns the first violation: n − 2 triangles, their orientation, the total area, each side of the polygon in one
/// triangle, and every other side in two with opposite directions.
std::string wrong_with(const Flat& polygon, const std::vector<std::array<int, 3>>& triangles) {
  if (triangles.size() + 2 != polygon.size()) return std::to_string(triangles.size()) + " triangles";
  const double whole = area(polygon);
  double sum = 0;
  std::set<std::pair<int, int>> sides;
  for (const auto& triangle : triangles) {
    Flat corners;
    for (std::size_t i = 0; i < 3; ++i) {
      corners.push_back(polygon[at(triangle[i])]);
      if (!sides.emplace(triangle[i], triangle[(i + 1) % 3]).second) return "a side twice";
    }
    if (area(corners) * whole < -1e-12 * whole * whole) return "a triangle is turned";
    sum += area(corners);
  }
  if (std::abs(sum / whole - 1) > 1e-9) return "the area is " + std::to_string(sum / whole);
  const int count = static_cast<int>(polygon.size());
  for (int i = 0; i < count; ++i) {
    if (sides.erase({i, (i + 1) % count}) != 1) return "a side is missing";
  }
  for (const auto& [from, to] : sides) {
    if (!sides.contains({to, from})) return "a side has no other";
  }
  return "";
}

Flat from(const Flat& polygon, std::size_t start) {
  Flat turned = polygon;
  std::rotate(turned.begin(), turned.begin() + static_cast<std::ptrdiff_t>(start), turned.end());
  return turned;
}

const Flat kL{{0, 0}, {30, 0}, {30, 10}, {10, 10}, {10, 30}, {0, 30}};
const Flat kU{{0, 0}, {30, 0}, {30, 30}, {20, 30}, {20, 10}, {10, 10}, {10, 30}, {0, 30}};
/// Shapes with corners of 180°.
const Flat kStraight{{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
const Flat kStraightL{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {2, 1}, {1, 1}, {1, 2}, {1, 3}, {0, 3}, {0, 1}};
const Flat kSpiral{{0, 0}, {7, 0}, {7, 7}, {1, 7}, {1, 2}, {5, 2}, {5, 5}, {3, 5},
                   {3, 4}, {4, 4}, {4, 3}, {2, 3}, {2, 6}, {6, 6}, {6, 1}, {0, 1}};

TEST(Polygons, ConcaveOnesAreCutAtEveryCornerAndInBothDirections) {
  for (const Flat& polygon : {kL, kU, kStraight, kStraightL, kSpiral}) {
    for (std::size_t start = 0; start < polygon.size(); ++start) {
      Flat turned = from(polygon, start);
      EXPECT_EQ(sides_that_meet(turned), std::nullopt);
      EXPECT_EQ(wrong_with(turned, triangles_of(turned)), "") << polygon.size() << ' ' << start;
      std::ranges::reverse(turned);
      EXPECT_EQ(wrong_with(turned, triangles_of(turned)), "") << polygon.size() << ' ' << start << " backwards";
    }
  }
}

TEST(Polygons, ThoseWithoutReflexCornersAreCutFromTheirFirst) {
  const Flat pentagon{{0, 0}, {2, 0}, {3, 1}, {2, 2}, {0, 2}};
  EXPECT_EQ(triangles_of(pentagon), (std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(Polygons, OnesThatAreNotSimpleAreFoundByTheSidesThatMeet) {
  using Sides = std::optional<std::pair<int, int>>;
  EXPECT_EQ(sides_that_meet({{0, 0}, {2, 2}, {2, 0}, {0, 2}}), Sides(std::pair(0, 2))) << "a bow tie";
  EXPECT_EQ(sides_that_meet({{0, 0}, {4, 0}, {4, 4}, {2, 0}, {0, 4}}), Sides(std::pair(0, 2))) << "a corner on a side";
  EXPECT_EQ(sides_that_meet({{0, 0}, {4, 0}, {2, 0}, {2, 4}}), Sides(std::pair(0, 1))) << "back on its own way";
  EXPECT_EQ(sides_that_meet({{0, 0}, {2, 0}, {2, 2}, {1, 1}, {1, 3}, {1, 1}, {0, 2}}), Sides(std::pair(2, 4)))
      << "a hair";
  EXPECT_EQ(sides_that_meet({{0, 0}, {1, 0}, {2, 0}}), Sides(std::pair(1, 2))) << "without an area";
  EXPECT_TRUE(sides_that_meet({{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {3, 3}, {3, 6}, {6, 6}, {6, 3}, {3, 3}}))
      << "a hole with a bridge";
  EXPECT_EQ(sides_that_meet(kSpiral), std::nullopt);
}

TEST(Polygons, ARoundingErrorBesideALineIsSeen) {
  const double less = std::nextafter(0.5, 0);
  EXPECT_EQ(sides_that_meet({{0.5, 0.5}, {12, 12}, {24, 24}, {0, 30}}), std::nullopt);
  const Flat reflex{{0.5, less}, {12, 12}, {24, 24}, {0, 30}};
  EXPECT_EQ(wrong_with(reflex, triangles_of(reflex)), "");
  EXPECT_EQ(triangles_of(reflex).front(), (std::array{1, 2, 3})) << "not the one across the corner that is reflex";
  const Flat convex{{less, 0.5}, {12, 12}, {24, 24}, {0, 30}};
  EXPECT_EQ(wrong_with(convex, triangles_of(convex)), "");
}

Flat star(Dice& dice) {
  const int count = 4 + static_cast<int>(dice.within(0, 30));  // all gaps are less than 180°
  Flat made;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * std::numbers::pi * (i + dice.within(0, 0.9)) / count;
    made.emplace_back(dice.decades(-2, 0) * Eigen::Vector2d(std::cos(angle), std::sin(angle)));
  }
  return made;
}

/// The boundary of a random set of cells, with a corner at each grid point.
Flat around_cells(Dice& dice) {
  using At = std::pair<int, int>;
  std::set<At> cells{{0, 0}};
  const auto has = [&](int x, int y) { return cells.contains({x, y}); };
  const int wanted = 1 + static_cast<int>(dice.within(0, 25));
  for (int tries = 0; tries < 400 && static_cast<int>(cells.size()) < wanted; ++tries) {
    const int x = static_cast<int>(dice.within(-6, 6));
    const int y = static_cast<int>(dice.within(-6, 6));
    if (has(x, y)) continue;
    constexpr std::array<std::array<int, 2>, 8> kRing{
        {{1, 0}, {1, 1}, {0, 1}, {-1, 1}, {-1, 0}, {-1, -1}, {0, -1}, {1, -1}}};
    int changes = 0;
    int sides = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      const auto& [ax, ay] = kRing[i];
      const auto& [bx, by] = kRing[(i + 1) % 8];
      changes += has(x + ax, y + ay) != has(x + bx, y + by) ? 1 : 0;
      sides += i % 2 == 0 && has(x + ax, y + ay) ? 1 : 0;
    }
    if (changes == 2 && sides > 0) cells.emplace(x, y);
  }
  std::map<At, At> next;
  for (const auto& [x, y] : cells) {
    if (!has(x, y - 1)) next[{x, y}] = {x + 1, y};
    if (!has(x + 1, y)) next[{x + 1, y}] = {x + 1, y + 1};
    if (!has(x, y + 1)) next[{x + 1, y + 1}] = {x, y + 1};
    if (!has(x - 1, y)) next[{x, y + 1}] = {x, y};
  }
  Flat made;
  for (At here = next.begin()->first; made.size() < next.size(); here = next.at(here)) {
    made.emplace_back(here.first, here.second);
  }
  return made;
}

TEST(Polygons, DrawnOnesAreFilledByTheirTriangles) {
  Dice dice(1);
  int concave = 0;
  for (int i = 0; i < property_cases(); ++i) {
    Flat polygon = dice.chance(0.5) ? star(dice) : around_cells(dice);
    if (dice.chance(0.5)) std::ranges::reverse(polygon);
    ASSERT_EQ(sides_that_meet(polygon), std::nullopt) << "case " << i;
    ASSERT_EQ(wrong_with(polygon, triangles_of(polygon)), "") << "case " << i;
    // The same polygon in space. Collinear corners are no longer exactly collinear.
    const Eigen::AngleAxisd turn(dice.within(0, 6), dice.direction());
    const Vec3 shift(dice.within(-100, 100), dice.within(-100, 100), dice.within(-100, 100));
    std::vector<Vec3> corners;
    for (const Eigen::Vector2d& corner : polygon) corners.emplace_back(turn * Vec3(corner.x(), corner.y(), 0) + shift);
    const Flat seen = flat(corners);
    ASSERT_EQ(sides_that_meet(seen), std::nullopt) << "case " << i << " in space";
    ASSERT_EQ(wrong_with(seen, triangles_of(seen)), "") << "case " << i << " in space";
    concave += triangles_of(polygon).front() != std::array{0, 1, 2} ? 1 : 0;
  }
  EXPECT_GT(concave, property_cases() / 2);
}

}  // namespace
}  // namespace tendon::softbody::polygon_test
