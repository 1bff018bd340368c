// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/field/primitives.h"

namespace tendon::field {

/// A signed distance field of any shape: bricks of 8³ weights of a quadratic B-spline, only where the surface is near.
///     φ(x) = scale Σ_ijk w_ijk β(s₁ − i) β(s₂ − j) β(s₃ − k),   s = (x − origin)/h
///     β(t) = 3/4 − t² for |t| ≤ 1/2,   ½(3/2 − |t|)² for |t| ≤ 3/2,   otherwise 0
/// φ and ∇φ are continuous near the surface. On a loop on which a proxy on a trilinear field loses 500 µJ, one on this
/// field loses 4 µJ (tests/core/field/leak_test.cc). Weights are the values of φ after the prefilter (−1, 10, −1)/8
/// along each axis, because β smooths.
///
/// Every node within kBand spacings of the surface must be in a brick. Elsewhere a coarse lattice with one cell per
/// brick gives a lower bound of |φ| and no gradient:
///     |φ| ≥ h + 8 h (c − 1),   c = cells to the nearest brick (Chebyshev)
/// The sign is that of the neighbouring bricks. Outside the lattice, φ is that of its nearest point, plus the way to
/// there if φ is positive.
///
/// Source: Condat, Blu and Unser, "Beyond interpolation: optimal reconstruction by quasi-interpolation", ICIP 2005.
/// Only the constructor allocates memory (`memory()`, 2.3 MB). Thread-safe: only `at`.
class BrickField {
 public:
  static constexpr int kSide = 8;
  static constexpr std::size_t kNodes = 512;
  static constexpr std::size_t kMostBricks = 1023;
  static constexpr std::size_t kMostCells = 65536;
  static constexpr double kBand = 2.5;
  static constexpr double kLeastSpacing = 0.25e-3;  ///< m
  static constexpr double kMostSpacing = 8e-3;      ///< m
  static constexpr double kMostExtent = 2;          ///< m, largest length of the lattice, and largest distance
  static constexpr double kMostOrigin = 1e12;       ///< m

  using Place = std::array<std::uint16_t, 3>;        ///< number of a brick along x, y and z
  using Weights = std::array<std::int16_t, kNodes>;  ///< x fastest, then y, then z

  struct Lattice {
    Vec3 origin = Vec3::Zero();  ///< node 0 of brick 0
    double spacing = 1e-3;       ///< h, m
    double scale = 1e-7;         ///< m per unit of a weight, > 0; 32767 units are at most kMostExtent
    Place bricks{1, 1, 1};       ///< along x, y and z

    /// The number of places, at most kMostCells.
    std::size_t cells() const noexcept { return std::size_t{bricks[0]} * bricks[1] * bricks[2]; }
    /// Returns an error message for the first number that is out of its range, or an empty string.
    std::string refused() const;
  };

  BrickField();

  /// Removes all bricks. Throws std::invalid_argument with the text of `lattice.refused()`.
  void reset(const Lattice& lattice);

  /// Adds a brick. Throws std::invalid_argument if the place is outside the lattice or taken, or if there are
  /// kMostBricks.
  void put(const Place& place, const Weights& weights, std::uint8_t material = 0);

  /// Must be called after the last brick: fills the aprons and the coarse lattice. An apron without a neighbour
  /// extrapolates the weights of the brick linearly.
  void finish() noexcept;

  /// Realtime-safe: yes. Needs about 80 additions and multiplications.
  SurfacePoint at(const Vec3& x) const noexcept;

  const Lattice& lattice() const noexcept { return lattice_; }
  std::size_t bricks() const noexcept { return used_; }
  static std::size_t memory() noexcept { return kMostBricks * sizeof(Brick) + kMostCells * sizeof(Cell); }  ///< bytes

 private:
  static constexpr int kWide = kSide + 2;  ///< with the apron

  struct Brick {
    std::array<std::int16_t, kWide * kWide * kWide> weights{};
    Place place{};
    std::uint8_t material = 0;
  };
  struct Cell {
    std::int16_t brick = -1;
    std::int16_t cells = 0;  ///< ± c, or 0 in a brick; negative inside the solid
  };

  static int away(const Cell& cell) noexcept;  ///< c
  std::size_t cell_at(int x, int y, int z) const noexcept;
  const Brick* brick_at(int x, int y, int z) const noexcept;
  void fill_apron(Brick& brick) noexcept;
  void spread(int x, int y, int z, int way) noexcept;

  Lattice lattice_;
  std::vector<Brick> bricks_;
  std::vector<Cell> cells_;
  std::size_t used_ = 0;
};

/// Returns the prefiltered weights of one brick of the field `signed_distance` (m). Weights beyond ±32767 are clamped.
BrickField::Weights weights_of(const std::function<double(const Vec3&)>& signed_distance,
                               const BrickField::Lattice& lattice, const BrickField::Place& place);

/// The bricks of a field, as they are uploaded.
struct SampledField {
  struct Brick {
    BrickField::Place place{};
    BrickField::Weights weights{};
  };
  BrickField::Lattice lattice{};
  std::vector<Brick> bricks{};
};

/// Returns the bricks of `signed_distance` between `low` and `high`, with the scale for a band of 16 h. Throws
/// std::invalid_argument as `reset`, and if there are more than kMostBricks. Realtime-safe: no.
SampledField sampled(const std::function<double(const Vec3&)>& signed_distance, const Vec3& low, const Vec3& high,
                     double spacing);

/// Fills `field` with the bricks of sampled(). Realtime-safe: no.
void sample(const std::function<double(const Vec3&)>& signed_distance, const Vec3& low, const Vec3& high,
            double spacing, BrickField& field);

}  // namespace tendon::field
