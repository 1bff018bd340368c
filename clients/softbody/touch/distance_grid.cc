// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/distance_grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

constexpr int kAround = 2;  // points outside the box
constexpr double kRoundingOfWay = 1e-6;

struct Splines {  // cubic B-splines
  std::array<double, 4> value, slope, bend;

  explicit Splines(double t) {  // 0 ≤ t ≤ 1
    const double s = 1 - t;
    value = {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6, t * t * t / 6};
    slope = {-s * s / 2, -2 * t + 1.5 * t * t, 2 * s - 1.5 * s * s, t * t / 2};
    bend = {s, 3 * t - 2, 3 * s - 2, t};
  }
};

struct Samples {
  std::array<int, 3> count;
  std::vector<double> values;

  std::size_t step(std::size_t axis) const {
    std::size_t sum = 1;
    for (std::size_t i = 0; i < axis; ++i) sum *= static_cast<std::size_t>(count[i]);
    return sum;
  }
  Samples to_weights(std::size_t axis) const {
    Samples made{count, {}};
    made.count[axis] -= 2;
    made.values.reserve(values.size());
    const std::size_t step = this->step(axis);
    for (int k = 0; k < made.count[2]; ++k) {
      for (int j = 0; j < made.count[1]; ++j) {
        for (int i = 0; i < made.count[0]; ++i) {
          const std::size_t first = softbody::at(i) + this->step(1) * softbody::at(j) + this->step(2) * softbody::at(k);
          made.values.push_back((8 * values[first + step] - values[first] - values[first + 2 * step]) / 6);
        }
      }
    }
    return made;
  }
};

}  // namespace

DistanceGrid::DistanceGrid(const std::function<double(const Vec3&)>& distance, const Vec3& low, const Vec3& high,
                           double cell)
    : low_(low), high_(high), cell_(cell) {
  expect_above_zero(cell, "cell");
  Samples samples{};
  double points = 1;
  for (int axis = 0; axis < 3; ++axis) points *= std::ceil((high[axis] - low[axis]) / cell) + 1 + 2 * kAround;
  if (!(points <= static_cast<double>(kMostPoints))) {
    std::ostringstream text;
    text << "cells of " << 1e3 * cell << " mm require " << points << " grid points, expected at most " << kMostPoints
         << ": use larger cells";
    throw std::invalid_argument(text.str());
  }
  for (int axis = 0; axis < 3; ++axis) {
    cells_[softbody::at(axis)] = std::max(1, static_cast<int>(std::ceil((high[axis] - low[axis]) / cell)));
    samples.count[softbody::at(axis)] = cells_[softbody::at(axis)] + 1 + 2 * kAround;
  }
  samples.values.reserve(static_cast<std::size_t>(points));
  for (int k = 0; k < samples.count[2]; ++k) {
    for (int j = 0; j < samples.count[1]; ++j) {
      for (int i = 0; i < samples.count[0]; ++i) {
        const Vec3 x = low + cell * (Vec3(i, j, k) - Vec3::Constant(kAround));
        const double here = distance(x);
        const std::array<int, 3> index{i, j, k};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (index[axis] == 0) continue;
          const double before = samples.values[samples.values.size() - samples.step(axis)];
          if (std::abs(here - before) <= cell * (1 + kRoundingOfWay)) continue;
          std::ostringstream text;
          text << "the distance jumps from " << 1e3 * before << " to " << 1e3 * here << " mm at ("
               << 1e3 * x.transpose() << ") mm: parts of the surface are inside others";
          throw std::invalid_argument(text.str());
        }
        samples.values.push_back(here);
      }
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) samples = samples.to_weights(axis);
  weights_.assign(samples.values.begin(), samples.values.end());
}

struct DistanceGrid::Around {
  const float* first;
  std::size_t row, layer;
  Splines x, y, z;
};

DistanceGrid::Around DistanceGrid::around(const Vec3& x) const {
  std::array<std::size_t, 3> cell{};
  Vec3 share;
  for (int axis = 0; axis < 3; ++axis) {
    const double along = (x[axis] - low_[axis]) / cell_;
    const int whole = std::clamp(static_cast<int>(along), 0, cells_[softbody::at(axis)] - 1);
    cell[softbody::at(axis)] = softbody::at(whole);
    share[axis] = along - whole;
  }
  const std::size_t row = softbody::at(cells_[0]) + 3;
  const std::size_t layer = row * (softbody::at(cells_[1]) + 3);
  return {weights_.data() + cell[0] + row * cell[1] + layer * cell[2],
          row,
          layer,
          Splines(share.x()),
          Splines(share.y()),
          Splines(share.z())};
}

Distance DistanceGrid::within(const Vec3& place) const {
  const auto [first, row, layer, along_x, along_y, along_z] = around(place);
  double value = 0;
  Vec3 slope = Vec3::Zero();
  double xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    double v = 0, x1 = 0, y1 = 0, x2 = 0, x1y1 = 0, y2 = 0;
    for (std::size_t j = 0; j < 4; ++j) {
      const float* w = first + k * layer + j * row;
      double a = 0, a1 = 0, a2 = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        a += along_x.value[i] * w[i];
        a1 += along_x.slope[i] * w[i];
        a2 += along_x.bend[i] * w[i];
      }
      v += along_y.value[j] * a;
      x1 += along_y.value[j] * a1;
      x2 += along_y.value[j] * a2;
      y1 += along_y.slope[j] * a;
      x1y1 += along_y.slope[j] * a1;
      y2 += along_y.bend[j] * a;
    }
    value += along_z.value[k] * v;
    slope += Vec3(along_z.value[k] * x1, along_z.value[k] * y1, along_z.slope[k] * v);
    xx += along_z.value[k] * x2;
    xy += along_z.value[k] * x1y1;
    yy += along_z.value[k] * y2;
    xz += along_z.slope[k] * x1;
    yz += along_z.slope[k] * y1;
    zz += along_z.bend[k] * v;
  }
  Distance found{.value = value, .gradient = slope / cell_};
  found.curvature << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  found.curvature /= cell_ * cell_;
  return found;
}

/// Returns the point of the surface that is nearest to where the line from `x` enters the box.
Vec3 DistanceGrid::foot_of(const Vec3& x) const {
  const auto below = [&](const Vec3& entry) -> Vec3 {
    const Distance there = within(entry);
    return entry - there.value * there.gradient.normalized();
  };
  const Vec3 first = below(x.cwiseMax(low_).cwiseMin(high_));
  const Vec3 way = x - first;
  double share = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double border = way[axis] > 0 ? high_[axis] : low_[axis];
    if (way[axis] != 0) share = std::min(share, (border - first[axis]) / way[axis]);
  }
  return below((first + std::max(0.0, share) * way).cwiseMax(low_).cwiseMin(high_));
}

Distance DistanceGrid::at(const Vec3& x) const {
  if (!x.allFinite()) return {.value = std::numeric_limits<double>::quiet_NaN()};
  if ((x.array() >= low_.array()).all() && (x.array() <= high_.array()).all()) return within(x);
  const Vec3 way = x - foot_of(x);
  Distance found{.value = way.norm()};
  found.gradient = way / found.value;
  found.curvature = (Mat3::Identity() - found.gradient * found.gradient.transpose()) / found.value;
  return found;
}

double DistanceGrid::value(const Vec3& x) const {
  if (!((x.array() >= low_.array()).all() && (x.array() <= high_.array()).all())) return at(x).value;
  const Around cell = around(x);
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    double of_layer = 0;
    for (std::size_t j = 0; j < 4; ++j) {
      const float* w = cell.first + k * cell.layer + j * cell.row;
      double of_row = 0;
      for (std::size_t i = 0; i < 4; ++i) of_row += cell.x.value[i] * w[i];
      of_layer += cell.y.value[j] * of_row;
    }
    sum += cell.z.value[k] * of_layer;
  }
  return sum;
}

}  // namespace tendon::softbody
