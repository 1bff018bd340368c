// SPDX-License-Identifier: Apache-2.0
#include "core/field/brick_field.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core/base/expect.h"
#include "core/base/portable_math.h"

namespace tendon::field {
namespace {

constexpr double kBiggestWeight = 32767;
constexpr std::array<double, 3> kPrefilter = {-0.125, 1.25, -0.125};
constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

std::int16_t rounded_weight(double value) noexcept {
  return static_cast<std::int16_t>(portable::round(std::clamp(value, -kBiggestWeight, kBiggestWeight)));
}

/// Returns β and β′ at the three nearest nodes. t is the distance from the middle node in spacings.
struct Taps {
  std::array<double, 3> value;
  std::array<double, 3> slope;
};

Taps taps(double t) noexcept {
  const double below = 0.5 - t;
  const double above = 0.5 + t;
  return {.value = {0.5 * below * below, 0.75 - t * t, 0.5 * above * above}, .slope = {-below, -2 * t, above}};
}

/// The index of a weight of a brick with its apron. The apron has the indices 0 and kSide + 1.
std::size_t weight_at(int i, int j, int k) noexcept {
  constexpr std::size_t kWide = BrickField::kSide + 2;
  return (static_cast<std::size_t>(k) * kWide + static_cast<std::size_t>(j)) * kWide + static_cast<std::size_t>(i);
}

}  // namespace

int BrickField::away(const Cell& cell) noexcept { return std::max<int>(cell.cells, -cell.cells); }

BrickField::BrickField() : bricks_(kMostBricks), cells_(kMostCells) {}

std::string BrickField::Lattice::refused() const {
  for (std::size_t i = 0; i < 3; ++i) {
    const double along = origin[static_cast<Eigen::Index>(i)];
    if (!(std::abs(along) <= kMostOrigin)) return not_expected(std::string("origin.") + kAxes[i], along, "±1e12 m");
  }
  if (!(spacing >= kLeastSpacing && spacing <= kMostSpacing)) {
    return not_expected("spacing", spacing, "0.00025 … 0.008 m");
  }
  if (!(scale > 0 && scale * kBiggestWeight <= kMostExtent)) {
    return not_expected("scale", scale, "above 0, and at most 2 m in 32767");
  }
  for (std::size_t i = 0; i < 3; ++i) {
    if (bricks[i] == 0 || bricks[i] * kSide * spacing > kMostExtent) {
      return not_expected(std::string("lattice.") + kAxes[i], bricks[i], "1 or more, and at most 2 m");
    }
  }
  if (cells() <= kMostCells) return {};
  return not_expected("lattice", static_cast<double>(cells()), "at most " + std::to_string(kMostCells) + " cells");
}

void BrickField::reset(const Lattice& lattice) {
  if (const std::string why = lattice.refused(); !why.empty()) throw std::invalid_argument(why);
  lattice_ = lattice;
  used_ = 0;
  std::fill(cells_.begin(), cells_.begin() + static_cast<std::ptrdiff_t>(lattice.cells()), Cell{});
}

void BrickField::put(const Place& place, const Weights& weights, std::uint8_t material) {
  for (std::size_t i = 0; i < 3; ++i) {
    expect(place[i] < lattice_.bricks[i], std::string("place.") + kAxes[i], place[i],
           "below " + std::to_string(lattice_.bricks[i]));
  }
  Cell& cell = cells_[cell_at(place[0], place[1], place[2])];
  expect(cell.brick < 0, "place", static_cast<double>(used_), "a brick at a free place; this one has a brick");
  expect(used_ < kMostBricks, "bricks", static_cast<double>(used_ + 1), "at most " + std::to_string(kMostBricks));
  cell.brick = static_cast<std::int16_t>(used_);
  Brick& brick = bricks_[used_++];
  brick.place = place;
  brick.material = material;
  for (std::size_t k = 0; k < kSide; ++k) {
    for (std::size_t j = 0; j < kSide; ++j) {
      const auto row = weights.begin() + static_cast<std::ptrdiff_t>((k * kSide + j) * kSide);
      std::copy(row, row + kSide,
                brick.weights.begin() + static_cast<std::ptrdiff_t>(((k + 1) * kWide + j + 1) * kWide + 1));
    }
  }
}

std::size_t BrickField::cell_at(int x, int y, int z) const noexcept {
  return (static_cast<std::size_t>(z) * lattice_.bricks[1] + static_cast<std::size_t>(y)) * lattice_.bricks[0] +
         static_cast<std::size_t>(x);
}

const BrickField::Brick* BrickField::brick_at(int x, int y, int z) const noexcept {
  if (x < 0 || y < 0 || z < 0 || x >= lattice_.bricks[0] || y >= lattice_.bricks[1] || z >= lattice_.bricks[2]) {
    return nullptr;
  }
  const std::int16_t brick = cells_[cell_at(x, y, z)].brick;
  return brick < 0 ? nullptr : &bricks_[static_cast<std::size_t>(brick)];
}

void BrickField::fill_apron(Brick& brick) noexcept {
  const auto index = [](const std::array<int, 3>& n) { return weight_at(n[0] + 1, n[1] + 1, n[2] + 1); };
  // The order is faces, edges, corners. Missing weights are extrapolated along the first axis that leaves the brick.
  for (int leaving = 1; leaving <= 3; ++leaving) {
    std::array<int, 3> n{};
    for (n[2] = -1; n[2] <= kSide; ++n[2]) {
      for (n[1] = -1; n[1] <= kSide; ++n[1]) {
        for (n[0] = -1; n[0] <= kSide; ++n[0]) {
          std::array<int, 3> beyond{};
          int first = -1;
          int count = 0;
          for (int a = 2; a >= 0; --a) {
            const auto axis = static_cast<std::size_t>(a);
            beyond[axis] = n[axis] < 0 ? -1 : n[axis] >= kSide ? 1 : 0;
            if (beyond[axis] == 0) continue;
            first = a;
            ++count;
          }
          if (count != leaving) continue;
          const Brick* const other =
              brick_at(brick.place[0] + beyond[0], brick.place[1] + beyond[1], brick.place[2] + beyond[2]);
          if (other != nullptr) {
            std::array<int, 3> there{};
            for (std::size_t a = 0; a < 3; ++a) there[a] = n[a] - kSide * beyond[a];
            brick.weights[index(n)] = other->weights[index(there)];
            continue;
          }
          std::array<int, 3> near = n;
          std::array<int, 3> far = n;
          const auto axis = static_cast<std::size_t>(first);
          near[axis] -= beyond[axis];
          far[axis] -= 2 * beyond[axis];
          brick.weights[index(n)] = rounded_weight(2.0 * brick.weights[index(near)] - brick.weights[index(far)]);
        }
      }
    }
  }
}

/// Computes distance and sign from the neighbours that were visited before in this direction.
void BrickField::spread(int x, int y, int z, int way) noexcept {
  Cell& cell = cells_[cell_at(x, y, z)];
  if (cell.brick >= 0) return;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if ((dz * 9 + dy * 3 + dx) * way >= 0) continue;
        const int i = x + dx;
        const int j = y + dy;
        const int k = z + dz;
        if (i < 0 || j < 0 || k < 0 || i >= lattice_.bricks[0] || j >= lattice_.bricks[1] || k >= lattice_.bricks[2]) {
          continue;
        }
        const Cell& other = cells_[cell_at(i, j, k)];
        if (other.brick < 0 && other.cells == 0) continue;  // unknown
        const int cells = away(other) + 1;
        if (cell.cells != 0 && away(cell) <= cells) continue;
        bool inside = other.cells < 0;
        if (other.brick >= 0) {  // use the sign of the nearest node
          const auto node = [](int d) { return d == 0 ? kSide / 2 : d > 0 ? 1 : kSide; };
          const Brick& brick = bricks_[static_cast<std::size_t>(other.brick)];
          inside = brick.weights[weight_at(node(dx), node(dy), node(dz))] < 0;
        }
        cell.cells = static_cast<std::int16_t>(inside ? -cells : cells);
      }
    }
  }
}

void BrickField::finish() noexcept {
  for (std::size_t i = 0; i < used_; ++i) fill_apron(bricks_[i]);
  const int nx = lattice_.bricks[0];
  const int ny = lattice_.bricks[1];
  const int nz = lattice_.bricks[2];
  if (used_ == 0) {
    const auto far = static_cast<std::int16_t>(kMostExtent / (kSide * lattice_.spacing));
    std::fill(cells_.begin(), cells_.begin() + static_cast<std::ptrdiff_t>(nx) * ny * nz, Cell{.cells = far});
    return;
  }
  // Two sweeps are exact for the Chebyshev distance.
  for (const int way : {1, -1}) {
    for (int k = 0; k < nz; ++k) {
      for (int j = 0; j < ny; ++j) {
        for (int i = 0; i < nx; ++i) {
          if (way > 0) {
            spread(i, j, k, way);
          } else {
            spread(nx - 1 - i, ny - 1 - j, nz - 1 - k, way);
          }
        }
      }
    }
  }
}

SurfacePoint BrickField::at(const Vec3& x) const noexcept {
  const Vec3 place = (x - lattice_.origin) / lattice_.spacing;
  std::array<int, 3> node{};
  std::array<Taps, 3> tap;
  double beyond = 0;  // squared, in spacings
  for (std::size_t a = 0; a < 3; ++a) {
    const double s = place[static_cast<Eigen::Index>(a)];
    const double inside = std::clamp(s, 0.0, lattice_.bricks[a] * kSide - 1.0);
    beyond += (s - inside) * (s - inside);
    node[a] = static_cast<int>(inside + 0.5);  // NOLINT(bugprone-incorrect-roundings): not negative
    tap[a] = taps(inside - node[a]);
  }
  const double way = beyond > 0 ? std::sqrt(beyond) * lattice_.spacing : 0;
  const Cell& cell = cells_[cell_at(node[0] / kSide, node[1] / kSide, node[2] / kSide)];
  SurfacePoint point;
  if (cell.brick < 0) {
    const double bound = lattice_.spacing * (1 + kSide * (away(cell) - 1.0));
    point.distance = cell.cells < 0 ? -bound : bound + way;
    return point;
  }
  const Brick& brick = bricks_[static_cast<std::size_t>(cell.brick)];
  const std::size_t corner = weight_at(node[0] % kSide, node[1] % kSide, node[2] % kSide);  // before the middle node
  double value = 0;
  double along_x = 0;
  double along_y = 0;
  double along_z = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t j = 0; j < 3; ++j) {
      const std::int16_t* const w = brick.weights.data() + corner + (k * kWide + j) * kWide;
      const double row = tap[0].value[0] * w[0] + tap[0].value[1] * w[1] + tap[0].value[2] * w[2];
      const double slope = tap[0].slope[0] * w[0] + tap[0].slope[1] * w[1] + tap[0].slope[2] * w[2];
      const double both = tap[1].value[j] * tap[2].value[k];
      value += both * row;
      along_x += both * slope;
      along_y += tap[1].slope[j] * tap[2].value[k] * row;
      along_z += tap[1].value[j] * tap[2].slope[k] * row;
    }
  }
  point.distance = value * lattice_.scale;
  if (point.distance > 0) point.distance += way;
  point.gradient = Vec3(along_x, along_y, along_z) * (lattice_.scale / lattice_.spacing);
  point.material = brick.material;
  return point;
}

BrickField::Weights weights_of(const std::function<double(const Vec3&)>& signed_distance,
                               const BrickField::Lattice& lattice, const BrickField::Place& place) {
  constexpr int kWide = BrickField::kSide + 2;
  std::array<double, kWide * kWide * kWide> values{};
  std::array<double, kWide * kWide * kWide> filtered{};
  std::size_t n = 0;
  for (int k = -1; k <= BrickField::kSide; ++k) {
    for (int j = -1; j <= BrickField::kSide; ++j) {
      for (int i = -1; i <= BrickField::kSide; ++i, ++n) {
        const Vec3 node(place[0] * BrickField::kSide + i, place[1] * BrickField::kSide + j,
                        place[2] * BrickField::kSide + k);
        values[n] = signed_distance(lattice.origin + lattice.spacing * node);
      }
    }
  }
  for (std::size_t stride = 1; stride <= kWide * kWide; stride *= kWide) {
    for (n = stride; n + stride < values.size(); ++n) {
      filtered[n] = kPrefilter[0] * values[n - stride] + kPrefilter[1] * values[n] + kPrefilter[2] * values[n + stride];
    }
    values = filtered;
  }
  BrickField::Weights weights{};
  n = 0;
  for (std::size_t k = 1; k <= BrickField::kSide; ++k) {
    for (std::size_t j = 1; j <= BrickField::kSide; ++j) {
      for (std::size_t i = 1; i <= BrickField::kSide; ++i) {
        weights[n++] = rounded_weight(values[(k * kWide + j) * kWide + i] / lattice.scale);
      }
    }
  }
  return weights;
}

SampledField sampled(const std::function<double(const Vec3&)>& signed_distance, const Vec3& low, const Vec3& high,
                     double spacing) {
  constexpr double kScaledBand = 16;
  const double side = BrickField::kSide * spacing;
  SampledField field{.lattice = {.origin = low, .spacing = spacing, .scale = kScaledBand * spacing / kBiggestWeight}};
  BrickField::Lattice& lattice = field.lattice;
  for (std::size_t a = 0; a < 3; ++a) {
    const double wanted = std::ceil((high - low)[static_cast<Eigen::Index>(a)] / side);
    expect(wanted >= 1 && wanted <= BrickField::kMostCells - 1, "extent", wanted, "1 … 65535 bricks along each axis");
    lattice.bricks[a] = static_cast<std::uint16_t>(wanted);
  }
  if (const std::string why = lattice.refused(); !why.empty()) throw std::invalid_argument(why);
  for (std::uint16_t k = 0; k < lattice.bricks[2]; ++k) {
    for (std::uint16_t j = 0; j < lattice.bricks[1]; ++j) {
      for (std::uint16_t i = 0; i < lattice.bricks[0]; ++i) {
        bool near = false;
        for (int n = 0; n < static_cast<int>(BrickField::kNodes) && !near; ++n) {
          const std::array<int, 3> in_brick{n % 8, n / 8 % 8, n / 64};
          const Vec3 node(i * BrickField::kSide + in_brick[0], j * BrickField::kSide + in_brick[1],
                          k * BrickField::kSide + in_brick[2]);
          near = std::abs(signed_distance(low + spacing * node)) < BrickField::kBand * spacing;
        }
        if (!near) continue;
        expect(field.bricks.size() < BrickField::kMostBricks, "bricks", static_cast<double>(field.bricks.size() + 1),
               "at most " + std::to_string(BrickField::kMostBricks));
        field.bricks.push_back({.place = {i, j, k}, .weights = weights_of(signed_distance, lattice, {i, j, k})});
      }
    }
  }
  return field;
}

void sample(const std::function<double(const Vec3&)>& signed_distance, const Vec3& low, const Vec3& high,
            double spacing, BrickField& field) {
  const SampledField from = sampled(signed_distance, low, high, spacing);
  field.reset(from.lattice);
  for (const SampledField::Brick& brick : from.bricks) field.put(brick.place, brick.weights);
  field.finish();
}

}  // namespace tendon::field
