// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/surface/polygon.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "clients/softbody/fem/places.h"

namespace tendon::softbody {
namespace {

using Vec2d = Eigen::Vector2d;

/// Exact sum of doubles as a nonoverlapping expansion (Shewchuk 1997, Grow-Expansion).
class ExactSum {
 public:
  void add_product(double a, double b) {
    const double product = a * b;
    add(std::fma(a, b, -product));
    add(product);
  }
  int sign() const {
    for (std::size_t i = count_; i-- > 0;) {
      if (parts_[i] != 0) return parts_[i] > 0 ? 1 : -1;
    }
    return 0;
  }

 private:
  void add(double value) {
    for (std::size_t i = 0; i < count_; ++i) {
      const double sum = value + parts_[i];
      const double virtually = sum - value;
      parts_[i] = (value - (sum - virtually)) + (parts_[i] - virtually);
      value = sum;
    }
    parts_[count_++] = value;
  }
  std::array<double, 12> parts_{};
  std::size_t count_ = 0;
};

/// Returns 1 if c is left of a–b, −1 if it is right, and 0 if it is on the line. The result is exact.
int side_of(const Vec2d& a, const Vec2d& b, const Vec2d& c) {
  const double left = (b.x() - a.x()) * (c.y() - a.y());
  const double right = (b.y() - a.y()) * (c.x() - a.x());
  constexpr double kError = (3 + 16 * std::numeric_limits<double>::epsilon()) * std::numeric_limits<double>::epsilon();
  const double difference = left - right;
  if (std::abs(difference) > kError * (std::abs(left) + std::abs(right))) return difference > 0 ? 1 : -1;
  ExactSum sum;
  sum.add_product(a.x(), b.y());
  sum.add_product(-a.y(), b.x());
  sum.add_product(b.x(), c.y());
  sum.add_product(-b.y(), c.x());
  sum.add_product(c.x(), a.y());
  sum.add_product(-c.y(), a.x());
  return sum.sign();
}

bool comes_before(const Vec2d& a, const Vec2d& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); }

/// The points must be collinear.
bool on_side(const Vec2d& a, const Vec2d& b, const Vec2d& x) {
  return comes_before(a, b) ? !comes_before(x, a) && !comes_before(b, x) : !comes_before(x, b) && !comes_before(a, x);
}

bool boxes_meet(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d) {
  return (a.cwiseMin(b).array() <= c.cwiseMax(d).array()).all() &&
         (c.cwiseMin(d).array() <= a.cwiseMax(b).array()).all();
}

bool sides_meet(const Vec2d& a, const Vec2d& b, const Vec2d& c, const Vec2d& d) {
  if (!boxes_meet(a, b, c, d)) return false;
  const int c_side = side_of(a, b, c);
  const int d_side = side_of(a, b, d);
  const int a_side = side_of(c, d, a);
  const int b_side = side_of(c, d, b);
  if (c_side * d_side < 0 && a_side * b_side < 0) return true;
  return (c_side == 0 && on_side(a, b, c)) || (d_side == 0 && on_side(a, b, d)) || (a_side == 0 && on_side(c, d, a)) ||
         (b_side == 0 && on_side(c, d, b));
}

class Rest {
 public:
  explicit Rest(const Flat& polygon) : points_(polygon), left_(static_cast<int>(polygon.size())) {
    const int count = left_;
    const int low = static_cast<int>(std::ranges::min_element(polygon, comes_before) - polygon.begin());
    const auto around = [&](int corner) -> const Vec2d& { return polygon[at((corner + count) % count)]; };
    if (side_of(around(low - 1), around(low), around(low + 1)) < 0) {  // use the mirror image
      for (Vec2d& point : points_) point.x() = -point.x();
    }
    for (int i = 0; i < count; ++i) {
      before_.push_back((i + count - 1) % count);
      after_.push_back((i + 1) % count);
    }
  }

  bool is_convex() const {
    for (int i = 0; i < static_cast<int>(points_.size()); ++i) {
      if (turn(i) <= 0) return false;
    }
    return true;
  }

  std::vector<std::array<int, 3>> ears() {
    std::vector<std::array<int, 3>> cut;
    std::vector<double> shapes(points_.size());
    for (std::size_t i = 0; i < shapes.size(); ++i) shapes[i] = shape_of_ear(static_cast<int>(i));
    while (left_ >= 3) {
      int best = best_of(shapes);
      if (best < 0) {
        for (int i = after_[at(last_)], n = 0; n < left_; i = after_[at(i)], ++n) shapes[at(i)] = shape_of_ear(i);
        best = best_of(shapes);
        if (best < 0) return {};
      }
      const int previous = before_[at(best)];
      const int next = after_[at(best)];
      cut.push_back({previous, best, next});
      after_[at(previous)] = next;
      before_[at(next)] = previous;
      last_ = previous;
      if (--left_ < 3) break;
      shapes[at(previous)] = shape_of_ear(previous);
      shapes[at(next)] = shape_of_ear(next);
    }
    return cut;
  }

 private:
  int turn(int corner) const {
    return side_of(points_[at(before_[at(corner)])], points_[at(corner)], points_[at(after_[at(corner)])]);
  }

  int best_of(const std::vector<double>& shapes) const {
    int best = -1;
    for (int i = after_[at(last_)], n = 0; n < left_; i = after_[at(i)], ++n) {
      if (shapes[at(i)] > 0 && (best < 0 || shapes[at(i)] > shapes[at(best)])) best = i;
    }
    return best;
  }

  /// Returns the area divided by the square of the longest side, or 0 if the corner is not an ear.
  double shape_of_ear(int corner) const {
    if (turn(corner) <= 0) return 0;
    const int previous = before_[at(corner)];
    const int next = after_[at(corner)];
    const Vec2d& a = points_[at(previous)];
    const Vec2d& b = points_[at(corner)];
    const Vec2d& c = points_[at(next)];
    const Vec2d low = a.cwiseMin(b).cwiseMin(c);
    const Vec2d high = a.cwiseMax(b).cwiseMax(c);
    for (int i = after_[at(next)]; i != previous; i = after_[at(i)]) {
      const Vec2d& x = points_[at(i)];
      if ((x.array() < low.array()).any() || (x.array() > high.array()).any()) continue;
      if (side_of(a, b, x) >= 0 && side_of(b, c, x) >= 0 && side_of(c, a, x) >= 0) return 0;
    }
    const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    const double area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    return std::max(area / longest, std::numeric_limits<double>::min());
  }

  Flat points_;
  std::vector<int> before_;
  std::vector<int> after_;
  int left_;
  int last_ = 0;
};

}  // namespace

Flat flat(std::span<const Vec3> corners) {
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    normal += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  }
  Eigen::Index along = 0;
  if (normal != Vec3::Zero()) {
    normal.cwiseAbs().maxCoeff(&along);
  } else {
    box_around(corners).sizes().minCoeff(&along);
  }
  Flat made;
  made.reserve(corners.size());
  for (const Vec3& corner : corners) made.emplace_back(corner[(along + 1) % 3], corner[(along + 2) % 3]);
  return made;
}

std::optional<std::pair<int, int>> sides_that_meet(const Flat& polygon) {
  const int count = static_cast<int>(polygon.size());
  const auto corner = [&](int i) -> const Vec2d& { return polygon[at(i % count)]; };
  for (int i = 0; i < count; ++i) {
    const Vec2d& a = corner(i);
    const Vec2d& b = corner(i + 1);
    const Vec2d& next = corner(i + 2);
    if (side_of(a, b, next) == 0 && !on_side(a, next, b)) return std::pair(i, (i + 1) % count);
    if (a == b) return std::pair(i, (i + 1) % count);
    for (int j = i + 2; j < count; ++j) {
      if ((j + 1) % count != i && sides_meet(a, b, corner(j), corner(j + 1))) return std::pair(i, j);
    }
  }
  return std::nullopt;
}

std::vector<std::array<int, 3>> triangles_of(const Flat& polygon) {
  Rest rest(polygon);
  if (!rest.is_convex()) return rest.ears();
  std::vector<std::array<int, 3>> fan;
  for (int i = 2; i < static_cast<int>(polygon.size()); ++i) fan.push_back({0, i - 1, i});
  return fan;
}

}  // namespace tendon::softbody
