// SPDX-License-Identifier: Apache-2.0
#include "core/field/material.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/expect.h"

namespace tendon::field {
namespace {

/// In each segment of the table, V′ is linear: V′(w) = V′(start) + slope (w − start).
struct Segment {
  double start = 0;  ///< m
  double end = 0;    ///< m
  double force = 0;  ///< N, V′ at the start
  double slope = 0;  ///< N/m, > 0
};

Segment segment(const Material& law, double dent, std::size_t i) noexcept {
  const DepthTable& table = law.table;
  const double spring = law.stiffness + law.branch;
  const double start = static_cast<double>(i) * table.step;
  const bool last = !table.used || i == DepthTable::kKnots;
  const double corrected = table.used ? table.force[i] : 0;
  return {.start = start,
          .end = last ? std::numeric_limits<double>::infinity() : start + table.step,
          .force = spring * start - law.branch * dent + corrected,
          .slope = spring + (last ? 0 : (table.force[i + 1] - table.force[i]) / table.step)};
}

std::size_t segment_of(const DepthTable& table, double depth) noexcept {
  if (!table.used || !(depth > 0)) return 0;
  const double place = depth / table.step;
  return place >= static_cast<double>(DepthTable::kKnots) ? DepthTable::kKnots : static_cast<std::size_t>(place);
}

/// C(w), the integral of the correction.
double integral(const DepthTable& table, double depth) noexcept {
  if (!table.used) return 0;
  const std::size_t last = segment_of(table, depth);
  double sum = 0;
  for (std::size_t i = 0; i < last; ++i) sum += 0.5 * table.step * (table.force[i] + table.force[i + 1]);
  const double rest = depth - static_cast<double>(last) * table.step;
  if (last == DepthTable::kKnots) return sum + rest * table.force[last];
  const double rise = (table.force[last + 1] - table.force[last]) / table.step;
  return sum + rest * (table.force[last] + 0.5 * rise * rest);
}

/// The correction in knot i of a table with this step.
double in_knot(const Material& law, double step, std::size_t i) noexcept {
  const DepthTable& table = law.table;
  return table.step == step || !table.used ? table.force[i] : law.correction(static_cast<double>(i) * step);
}

struct Range {
  double least = 0;
  double most = 0;
};

/// The allowed corrections of a knot after one with the correction `before`, in N.
Range range_after(double before, const Material& law, double max_stiffness) noexcept {
  const double rise = std::max(max_stiffness - law.stiffness - law.branch, 0.0);
  return {.least = before - (1 - Material::kLeastShare) * law.stiffness * law.table.step,
          .most = before + rise * law.table.step};
}

void expect_valid_table(const Material& law, double max_stiffness) {
  const DepthTable& table = law.table;
  if (!table.used) return;
  expect(table.step >= DepthTable::kLeastStep && table.step <= DepthTable::kMostStep, "table.step", table.step,
         shortest(DepthTable::kLeastStep) + " … " + shortest(DepthTable::kMostStep) + " m");
  expect(table.force[0] == 0, "table knot 0", table.force[0], "0 N");
  for (std::size_t i = 1; i <= DepthTable::kKnots; ++i) {
    const Range range = range_after(table.force[i - 1], law, max_stiffness);
    expect(table.force[i] >= range.least && table.force[i] <= range.most, "table knot " + std::to_string(i),
           table.force[i], rounded(range.least, 6) + " … " + rounded(range.most, 6) + " N");
  }
}

double potential(const Material& law, double w, double dent) noexcept {
  const double stretch = w - dent;
  return 0.5 * law.stiffness * w * w + integral(law.table, w) + 0.5 * law.branch * stretch * stretch;
}

}  // namespace

DepthTable DepthTable::of(double step, std::span<const double> forces) noexcept {
  DepthTable table{.step = step, .used = true};
  for (std::size_t i = 1; i <= kKnots; ++i) table.force[i] = forces[std::min(i, forces.size()) - 1];
  return table;
}

void Material::expect_valid(double max_stiffness) const {
  expect(stiffness > 0 && stiffness + branch <= max_stiffness, "stiffness", stiffness + branch,
         "above 0, and at most " + shortest(max_stiffness) + " N/m with the branch");
  expect_not_negative(branch, "branch");
  expect(tau >= kLeastTau && tau <= kMostTau, "tau", tau, "0.01 … 10 s");
  expect(friction >= 0 && friction <= kMostFriction, "friction", friction, "0 … 2");
  expect_valid_table(*this, max_stiffness);
}

double Material::rest(double dent) const noexcept {
  if (!(dent > 0) || branch == 0) return 0;
  for (std::size_t i = 0;; ++i) {
    const Segment at = segment(*this, dent, i);
    const double w = at.start - at.force / at.slope;
    if (w <= at.end) return std::max(w, at.start);
  }
}

double Material::energy(double depth, double dent) const noexcept {
  return potential(*this, std::max(depth, rest(dent)), dent);
}

double Material::spring(double depth, double dent) const noexcept {
  return depth > rest(dent) ? stiffness * depth + branch * (depth - dent) : 0;
}

double Material::force(double depth, double dent) const noexcept {
  return depth > rest(dent) ? stiffness * depth + branch * (depth - dent) + correction(depth) : 0;
}

double Material::slope(double depth, double dent) const noexcept {
  return depth > rest(dent) ? segment(*this, dent, segment_of(table, depth)).slope : 0;
}

double Material::relaxed(double depth, double dent, double period) const noexcept {
  if (branch == 0) return 0;
  return dent + (std::max(depth, rest(dent)) - dent) * (period / (tau + period));
}

double Material::depth_of(double energy, double dent, double most) const noexcept {
  const double from = rest(dent);
  double stored = potential(*this, from, dent);
  if (stored > energy) return 0;
  double depth = from;
  for (std::size_t i = segment_of(table, from);; ++i) {
    const Segment at = segment(*this, dent, i);
    const double force = at.force + at.slope * (depth - at.start);
    // ½ slope y² + force y = energy − stored, in the form that does not cancel.
    const double left = energy - stored;
    const double root = std::sqrt(force * force + 2 * at.slope * left);
    const double y = left > 0 ? 2 * left / (force + root) : 0;
    if (depth + y <= at.end || depth >= most) return std::min(depth + y, most);
    const double way = at.end - depth;
    stored += way * (force + 0.5 * at.slope * way);
    depth = at.end;
  }
}

double Material::most_stiffness() const noexcept {
  double most = 0;
  if (table.used) {
    for (std::size_t i = 0; i < DepthTable::kKnots; ++i) {
      most = std::max(most, (table.force[i + 1] - table.force[i]) / table.step);
    }
  }
  return stiffness + branch + most;
}

double Material::correction(double depth) const noexcept {
  if (!table.used || !(depth > 0)) return 0;
  const std::size_t i = segment_of(table, depth);
  if (i == DepthTable::kKnots) return table.force[i];
  const double rest = depth / table.step - static_cast<double>(i);
  return table.force[i] + rest * (table.force[i + 1] - table.force[i]);
}

Material blended(const Material& from, const Material& to, double share) noexcept {
  Material result = to;
  const double rest = 1 - share;
  result.stiffness = share * to.stiffness + rest * from.stiffness;
  result.branch = share * to.branch + rest * from.branch;
  result.friction = share * to.friction + rest * from.friction;
  result.table.used = from.table.used || to.table.used;
  if (!result.table.used) return result;
  double& step = result.table.step;  // the larger step, because the result must contain both tables
  if (from.table.used) step = to.table.used ? std::max(from.table.step, to.table.step) : from.table.step;
  for (std::size_t i = 0; i < result.table.force.size(); ++i) {
    result.table.force[i] = share * in_knot(to, step, i) + rest * in_knot(from, step, i);
  }
  return result;
}

void bound_table(Material& material, double max_stiffness) noexcept {
  auto& force = material.table.force;
  force[0] = 0;
  for (std::size_t i = 1; i < force.size(); ++i) {
    const Range range = range_after(force[i - 1], material, max_stiffness);
    force[i] = std::clamp(force[i], range.least, range.most);
  }
}

}  // namespace tendon::field
