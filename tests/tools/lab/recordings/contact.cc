// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/contact.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "tests/tools/lab/experiments/thinned.h"

namespace tendon::lab {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kNearAxis = 0.9986;      // cosine of 3°
constexpr double kSameDirection = 0.9;    // cos², mean
constexpr double kSmall = 0.01;           // fraction of the largest force; smaller forces are not pushes
constexpr double kNotWild = 0.99;         // quantile of the forces above which they are outliers
constexpr double kFrequent = 0.05;        // if this fraction of the forces is in free motion, these forces are noise
constexpr double kAboveNoise = 1.5;       // multiple of the noise's 95th percentile
constexpr double kPure = 0.75;            // minimum fraction of pushes in a contact
constexpr std::size_t kFewestPushes = 5;  // per contact
constexpr double kFewestSteps = 20;       // per contact
constexpr double kDeep = 0.1;             // fraction of the largest depth
constexpr double kMostError = 0.05;       // relative, of a stiffness
constexpr double kCorrelated = 10;        // number of successive forces with the same error

struct Answer {
  double x;
  double outermost;  ///< the minimum of `x` and the position where the force was used
  double outward;    ///< N
};

struct Edge {
  double at;
  double error;
  double deepest;  ///< the maximum of `x`
};

struct Gap {
  double without = -kUnbounded;  ///< last position in free motion
  double first = kUnbounded;     ///< the first push
};

/// The first position with the fewest pushes before it plus free forces after it. Both arguments are sorted.
std::optional<Gap> best_gap(const std::vector<double>& pushes, const std::vector<double>& free) {
  std::size_t wrong = free.size();
  std::size_t fewest = wrong;
  Gap best{.first = pushes.front()};
  std::size_t p = 0;
  std::size_t f = 0;
  while (p < pushes.size()) {
    const double here = f < free.size() ? std::min(pushes[p], free[f]) : pushes[p];
    for (; p < pushes.size() && pushes[p] == here; ++p) ++wrong;
    for (; f < free.size() && free[f] == here; ++f) --wrong;
    if (p < pushes.size() && wrong < fewest && (f == free.size() || pushes[p] < free[f])) {
      fewest = wrong;
      best = {.without = here, .first = pushes[p]};
    }
  }
  if (fewest >= pushes.size()) return std::nullopt;
  return best;
}

struct Fit {
  double zero;   ///< the position where the force is zero
  double slope;  ///< N/m
  double error;  ///< of `zero`, one standard deviation
};

std::optional<Fit> line_through(const std::vector<Answer>& pushes) {
  const auto n = static_cast<double>(pushes.size());
  double mean_x = 0;
  double mean_f = 0;
  for (const Answer& push : pushes) {
    mean_x += push.x / n;
    mean_f += push.outward / n;
  }
  double squares = 0;
  double products = 0;
  for (const Answer& push : pushes) {
    squares += (push.x - mean_x) * (push.x - mean_x);
    products += (push.x - mean_x) * (push.outward - mean_f);
  }
  const double slope = products / squares;
  const auto [nearest, deepest] = std::ranges::minmax(pushes, {}, &Answer::x);
  if (!(slope * (deepest.x - nearest.x) > kSmall * mean_f)) return std::nullopt;
  const double zero = mean_x - mean_f / slope;
  double residuals = 0;
  for (const Answer& push : pushes) {
    const double residual = push.outward - slope * (push.x - zero);
    residuals += residual * residual;
  }
  const double scatter = std::sqrt(residuals / n) / slope;  // m
  const double error = scatter * std::sqrt(kCorrelated * (1 / n + (mean_x - zero) * (mean_x - zero) / squares));
  return Fit{zero, slope, error};
}

/// Returns the smallest force in N that is not noise. This is `least` unless larger forces are frequent in free motion.
double above_noise(const std::vector<Answer>& answers, double first, double least) {
  std::vector<double> noise;
  std::size_t outside = 0;
  for (const Answer& answer : answers) {
    if (answer.x >= first) continue;
    ++outside;
    if (answer.outward > least) noise.push_back(answer.outward);
  }
  if (static_cast<double>(noise.size()) < kFrequent * static_cast<double>(outside)) return least;
  return kAboveNoise * percentile(std::move(noise), 0.95).value_or(least);
}

std::optional<Edge> find_edge(const std::vector<Answer>& answers, double least, bool is_above_noise = false) {
  std::vector<double> pushes;
  std::vector<double> free;
  for (const Answer& answer : answers) {
    if (answer.outward > least) {
      pushes.push_back(answer.x);
    } else {
      free.push_back(answer.outermost);
    }
  }
  if (pushes.empty()) return std::nullopt;
  std::ranges::sort(pushes);
  std::ranges::sort(free);
  const auto gap = best_gap(pushes, free);
  if (!gap) return std::nullopt;
  if (const double more = above_noise(answers, gap->first, least); more > least && !is_above_noise)
    return find_edge(answers, more, true);
  std::vector<Answer> inside;
  std::size_t all = 0;
  for (const Answer& answer : answers) {
    const bool push = answer.outward > least;
    if ((push ? answer.x : answer.outermost) < gap->first) continue;
    ++all;
    if (push) inside.push_back(answer);
  }
  if (inside.size() < kFewestPushes || static_cast<double>(inside.size()) < kPure * static_cast<double>(all))
    return std::nullopt;

  Edge edge{.at = gap->first, .error = gap->first - gap->without, .deepest = pushes.back()};
  const auto line = line_through(inside);
  if (!line) return edge;
  // Near the start of the contact the force of a spring is below `least`, so it counts as free motion.
  const double from = gap->without - 2 * least / line->slope;
  if (line->zero >= from && line->zero <= gap->first) {
    edge.at = line->zero;
    edge.error = std::min(line->error, gap->first - from);
  } else {
    edge.at = line->zero > gap->first ? gap->first : gap->without;
  }
  // If there are no forces in free motion, the line is only extrapolated up to its own length.
  if (std::isinf(gap->without) && gap->first - edge.at > edge.deepest - gap->first) edge.error = kUnbounded;
  return edge;
}

}  // namespace

double Contact::depth(double x) const noexcept {
  if (above && x > *above) return x - *above;
  if (below && x < *below) return *below - x;
  return 0;
}

double Contact::outward(double x, double force) const noexcept {
  if (above && x > *above) return -force;
  if (below && x < *below) return force;
  return 0;
}

std::optional<Vec3> common_direction(std::span<const Push> pushes) {
  std::vector<double> sizes;
  for (const Push& push : pushes) {
    if (!push.force.isZero(0)) sizes.push_back(push.force.norm());
  }
  const auto most = percentile(std::move(sizes), kNotWild);
  if (!most) return std::nullopt;
  Mat3 sum = Mat3::Zero();
  double weight = 0;
  for (const Push& push : pushes) {
    if (push.force.isZero(0)) continue;
    const Vec3 direction = push.force.stableNormalized();
    const double size = std::min(push.force.norm(), *most);
    sum += size * direction * direction.transpose();
    weight += size;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(sum / weight);
  if (solver.eigenvalues()[2] < kSameDirection) return std::nullopt;
  const Vec3 direction = solver.eigenvectors().col(2);  // eigenvalues are in increasing order
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (std::abs(direction[largest]) > kNearAxis) return Vec3::Unit(largest);
  return direction[largest] < 0 ? Vec3(-direction) : direction;
}

std::optional<Contact> find_contact(std::span<const Push> pushes, const Vec3& axis) {
  std::vector<Answer> up;
  std::vector<Answer> down;
  std::vector<double> sizes;
  for (const Push& push : pushes) {
    const double x = push.place.dot(axis);
    const double used = push.used.dot(axis);
    const double force = push.force.dot(axis);
    up.push_back({.x = x, .outermost = std::min(x, used), .outward = -force});
    down.push_back({.x = -x, .outermost = std::min(-x, -used), .outward = force});
    if (force != 0) sizes.push_back(std::abs(force));
  }
  const double least = kSmall * percentile(std::move(sizes), kNotWild).value_or(0);
  std::optional<Edge> above = find_edge(up, least);
  std::optional<Edge> below = find_edge(down, least);
  if (!above && !below) return std::nullopt;
  if (above && below && -below->at > above->at) {
    // Two contacts cannot overlap; the overlap is attributed to their error.
    above->at = (above->at - below->at) / 2;
    below->at = -above->at;
  }
  Contact contact;
  if (above) contact.above = above->at;
  if (below) contact.below = -below->at;
  contact.error = std::max(above ? above->error : 0, below ? below->error : 0);
  return contact;
}

std::optional<double> felt_stiffness(std::span<const FeltStep> felt, const Vec3& axis, const Contact& contact) {
  double deepest = 0;
  for (const FeltStep& step : felt) deepest = std::max(deepest, contact.depth(step.position.dot(axis)));
  double sum = 0;
  double sensitivity = 0;  // N/m², derivative of `sum` with respect to the contact position
  double count = 0;
  for (const FeltStep& step : felt) {
    const double x = step.position.dot(axis);
    const double depth = contact.depth(x);
    if (depth <= kDeep * deepest) continue;
    const double secant = contact.outward(x, step.force.dot(axis)) / depth;
    sum += secant;
    sensitivity += secant / depth;
    ++count;
  }
  if (count < kFewestSteps) return std::nullopt;
  if (!(contact.error * std::abs(sensitivity) <= kMostError * std::abs(sum))) return std::nullopt;
  return sum / count;
}

}  // namespace tendon::lab
