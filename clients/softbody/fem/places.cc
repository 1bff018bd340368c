// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/places.h"

#include <charconv>
#include <cmath>
#include <unordered_map>

namespace tendon::softbody {

Eigen::AlignedBox3d box_around(std::span<const Vec3> points) {
  Eigen::AlignedBox3d box;
  for (const Vec3& point : points) box.extend(point);
  return box;
}

std::size_t HashOfCell::operator()(const Cell& cell) const {
  std::uint64_t hash = 0;
  for (const std::int64_t along : cell) hash = (hash ^ static_cast<std::uint64_t>(along)) * 0x9E3779B97F4A7C15ULL;
  return hash ^ hash >> 32U;
}

Cell cell_of(const Vec3& point, const Vec3& origin, double size) {
  Cell cell{};
  for (int i = 0; i < 3; ++i) cell[at(i)] = static_cast<std::int64_t>(std::floor((point[i] - origin[i]) / size));
  return cell;
}

std::vector<int> first_at_place(std::span<const Vec3> points) {
  std::vector<int> first(points.size(), 0);
  if (points.empty()) return first;
  const Eigen::AlignedBox3d box = box_around(points);
  const double near = kSamePlace * box.sizes().maxCoeff();
  if (!(near > 0) || !std::isfinite(near)) return first;  // all points coincide
  std::unordered_map<Cell, std::vector<int>, HashOfCell> cells;
  const auto found_around = [&](const Vec3& point, const Cell& own) {
    for (std::int64_t x = -1; x <= 1; ++x) {
      for (std::int64_t y = -1; y <= 1; ++y) {
        for (std::int64_t z = -1; z <= 1; ++z) {
          const auto there = cells.find({own[0] + x, own[1] + y, own[2] + z});
          if (there == cells.end()) continue;
          for (const int candidate : there->second) {
            if ((points[at(candidate)] - point).norm() <= near) return candidate;
          }
        }
      }
    }
    return -1;
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Cell own = cell_of(points[i], box.min(), near);
    const int known = found_around(points[i], own);
    first[i] = known < 0 ? static_cast<int>(i) : known;
    if (known < 0) cells[own].push_back(first[i]);
  }
  return first;
}

std::string in_words(const Vec3& place) {
  std::string text = "(";
  for (const double value : place) {
    std::array<char, 32> digits{};
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, std::chars_format::general, 4);
    text.append(text.size() > 1 ? ", " : "").append(digits.data(), end.ptr);
  }
  return text + ")";
}

std::string counted(std::size_t count, std::string_view one, std::string_view several) {
  return std::to_string(count) + " " + std::string(count == 1 ? one : several);
}

}  // namespace tendon::softbody
