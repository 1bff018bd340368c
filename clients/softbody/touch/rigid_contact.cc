// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/rigid_contact.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

constexpr double kOnTheWay = 0.03;  ///< relative tolerance at intermediate positions
constexpr int kMostOnTheWay = 4;    ///< maximum number of steps there

constexpr double kMargin = 0.25;  ///< relative to the size of a facet

constexpr double kToolDecrease = 1e-4;      ///< Armijo's parameter
constexpr double kToolShortest = 1.0 / 64;  ///< the shortest step
constexpr double kContactRounding = 1e-13;  ///< rounding error of the energy

constexpr int kToolPatience = 16;  ///< number of steps until a new factor
constexpr int kMostMeets = 60;
constexpr double kMet = 1e-3;      ///< the remaining energy there, relative to that of an answer
constexpr double kNoDrop = 1e-24;  // smaller relative changes are rounding errors

constexpr double kToolUnseen = 1e-12;  ///< an error that corresponds to a smaller motion (m) is ignored
constexpr double kUnfelt = 1e-10;      ///< the same without contact

constexpr double kToolHeard = 1e-8;  ///< smaller relative changes are rounding errors

constexpr double kCurveError = 2e-3;  ///< accepted relative error of the stiffness
constexpr int kCurveRounds = 12;      ///< maximum number of rounds

constexpr double kToolNudge = 1e-7;  ///< step of finite differences, m

constexpr int kKept = 600;  ///< minimum number of columns

constexpr int kFarthest = 400;  ///< maximum number of steps back

bool finite(const Pose& pose) { return pose.position.allFinite() && pose.turn.allFinite(); }

Pose between(const Pose& from, const Pose& to, double share) {
  const Eigen::AngleAxisd turn(Mat3(to.turn * from.turn.transpose()));
  return {from.position + share * (to.position - from.position),
          Eigen::AngleAxisd(share * turn.angle(), turn.axis()).toRotationMatrix() * from.turn};
}

}  // namespace

struct RigidContact::Local {
  Elastic::Forces now;
  VectorXd solved;  ///< K₀⁻¹ times the forces
  Layer::Near near;
  std::vector<int> unknowns;  ///< free numbers
  std::vector<int> rows;      ///< rows of these unknowns
  Eigen::Matrix3Xd places;
  MatrixXd stiffness;  ///< R, N/m, of the body, with the other unknowns condensed
  Layer::Press press;
  MatrixXd curve;             ///< A, N/m, of the layer
  Eigen::LLT<MatrixXd> held;  ///< of R + A
  MatrixXd curve_held;        ///< A in this factor, with a shift if it is needed

  VectorXd slope() const { return press.slope(rows); }
  VectorXd spread(const VectorXd& among, Eigen::Index size) const {
    VectorXd all = VectorXd::Zero(size);
    all(unknowns) = among;
    return all;
  }
  Eigen::Matrix3Xd moved(const VectorXd& by) const {
    Eigen::Matrix3Xd all = places;
    all.reshaped()(rows) += by;
    return all;
  }
  /// Adds a shift to A until R + A is positive definite.
  static Eigen::LLT<MatrixXd> factor(const MatrixXd& stiffness, MatrixXd& curve) {
    Eigen::LLT<MatrixXd> found(stiffness + curve);
    for (double shift = 0.01; found.info() != Eigen::Success && shift < 1e9; shift *= 10) {
      curve.diagonal() += shift * stiffness.diagonal();
      found.compute(stiffness + curve);
    }
    return found;
  }
};

RigidContact::RigidContact(QuasiStaticModel& body, const Elastic& elastic, const TouchSurface& surface,
                           std::vector<HeldTool> tools, const Config& config)
    : body_(body),
      elastic_(elastic),
      tools_(std::move(tools)),
      config_(config),
      layer_(elastic,
             [&] {
               Layer::Config layer = config.layer;
               layer.tools = tools_.size();
               return layer;
             }()),
      from_(surface.normal()),
      rest_(body.displacements()),
      column_of_(at(elastic.free_count()), -1) {
  expect(!tools_.empty(), "tools", 0, "1 or more");
  expect_above_zero(config.tolerance, "tolerance");
  expect(config.max_iterations >= 1, "max_iterations", config.max_iterations, "1 or more");
  expect(body.step() == 0, "step", body.step(), "0: a quasi-static body");
  expect(body.self_collision() == nullptr, "self_collision", 1, "a body without self-collision");
  for (const HeldTool& tool : tools_) placed_.push_back({&tool, std::nullopt});
}

void RigidContact::renew(Local& local) {
  body_.renew_factor();
  local.solved = body_.factor().solve(local.now.force);
  in_vain_ = 0;
}

/// Updates the facets near the tools and the compliance of their nodes.
void RigidContact::look(Local& local) {
  if (factors_ != body_.factors()) {
    factors_ = body_.factors();
    pairs_.clear();
    std::ranges::fill(column_of_, -1);
    columns_ = 0;
  }
  local.near = layer_.near(placed_, body_.displacements(), kMargin);
  local.places = layer_.places(local.near, body_.displacements());
  local.unknowns.clear();
  local.rows.clear();
  for (std::size_t i = 0; i < local.near.nodes.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const int unknown = elastic_.free_of(3 * local.near.nodes[i] + c);
      if (unknown < 0) continue;
      local.unknowns.push_back(unknown);
      local.rows.push_back(3 * static_cast<int>(i) + c);
    }
  }
  const auto count = static_cast<int>(local.unknowns.size());
  const auto missing = [&] {
    std::vector<int> all;
    for (const int unknown : local.unknowns) {
      if (column_of_[at(unknown)] < 0) all.push_back(unknown);
    }
    return all;
  };
  std::vector<int> fresh = missing();
  if (columns_ + static_cast<int>(fresh.size()) > std::max(kKept, count)) {
    std::ranges::fill(column_of_, -1);
    columns_ = 0;
    fresh = missing();
  }
  if (!fresh.empty()) {
    const auto more = static_cast<int>(fresh.size());
    MatrixXd units = MatrixXd::Zero(elastic_.free_count(), more);
    for (int i = 0; i < more; ++i) {
      units(fresh[at(i)], i) = 1;
      column_of_[at(fresh[at(i)])] = columns_ + i;
    }
    if (follows_.cols() < columns_ + more) follows_.conservativeResize(elastic_.free_count(), columns_ + more);
    follows_.middleCols(columns_, more) = body_.factor().solve(units);
    columns_ += more;
  }
  std::vector<int> columns;
  for (const int unknown : local.unknowns) columns.push_back(column_of_[at(unknown)]);
  MatrixXd compliance = follows_(local.unknowns, columns);
  compliance += pairs_.adds(local.unknowns);
  local.stiffness =
      Eigen::LLT<MatrixXd>((compliance + compliance.transpose()) / 2).solve(MatrixXd::Identity(count, count));
}

/// Minimizes the energy of the layer and of a body with the stiffness R by Newton's method. `free` is the motion (m)
/// without the layer, and `enough` is the accepted error (J).
VectorXd RigidContact::meet(const Local& local, const VectorXd& free, double enough) const {
  VectorXd by = VectorXd::Zero(free.size());
  VectorXd slope = local.slope();
  MatrixXd curve = local.curve;
  VectorXd pull = local.stiffness * -free;
  double energy = local.press.energy - free.dot(pull) / 2;
  for (int round = 0; round < kMostMeets; ++round) {
    const VectorXd down = -(pull + slope);
    const VectorXd step = Local::factor(local.stiffness, curve).solve(down);
    const double drop = down.dot(step);
    if (!(drop > std::max(enough, kNoDrop * std::abs(energy)))) break;
    bool fell = false;
    for (double share = 1; share >= kToolShortest / 64 && !fell; share /= 2) {
      const VectorXd there = by + share * step;
      const VectorXd pull_there = local.stiffness * (there - free);
      const Layer::Press press = layer_.press(local.near, placed_, local.moved(there), Layer::Order::kCurve);
      const double energy_there = press.energy + (there - free).dot(pull_there) / 2;
      fell = energy_there - energy <= -kToolDecrease * share * drop + kContactRounding * std::abs(energy);
      if (!fell) continue;
      by = there;
      pull = pull_there;
      energy = energy_there;
      slope = press.slope(local.rows);
      curve = press.curve(local.rows, local.rows);
    }
    if (!fell) break;
  }
  return by;
}

VectorXd RigidContact::by_near(const Local& local, const VectorXd& forces) const {
  VectorXd solved = VectorXd::Zero(elastic_.free_count());
  for (Eigen::Index i = 0; i < forces.size(); ++i) {
    if (forces[i] != 0) solved += forces[i] * follows_.col(column_of_[at(local.unknowns[static_cast<std::size_t>(i)])]);
  }
  return pairs_.times(local.spread(forces, elastic_.free_count()), solved);
}

/// Returns (H⁻¹ + A)⁻¹ b by Woodbury's identity. `by_factor` is K₀⁻¹ b.
VectorXd RigidContact::solve(const Local& local, const VectorXd& b, const VectorXd& by_factor) const {
  const VectorXd free = pairs_.times(b, by_factor);
  if (local.unknowns.empty()) return free;
  const VectorXd near = local.held.solve(local.stiffness * free(local.unknowns));
  return free - by_near(local, local.curve_held * near);
}

bool RigidContact::go(const VectorXd& step, double slope, Local& local) {
  const double before = local.now.energy + local.press.energy;
  double gone = 0;
  for (double share = 1; share >= kToolShortest; share /= 2) {
    body_.move((share - gone) * step);
    gone = share;
    Elastic::Forces there = body_.forces();
    const double layer =
        layer_.press(local.near, placed_, layer_.places(local.near, body_.displacements()), Layer::Order::kEnergy)
            .energy;
    if (there.energy + layer - before <= kToolDecrease * share * slope + kContactRounding * std::abs(before)) {
      local.now = std::move(there);
      return true;
    }
  }
  body_.move(-gone * step);
  return false;
}

double RigidContact::stiffest(const Local& local, std::size_t tool) const {
  const Layer::Felt& felt = local.press.felt[tool];
  if (felt.area == 0) return config_.layer.young * tools_[tool].shape.reach();
  const MatrixXd mixed = felt.mixed(local.rows, Eigen::seqN(0, 3));
  const Mat3 k = felt.curve.topLeftCorner<3, 3>() - mixed.transpose() * local.held.solve(mixed);
  return k.norm();
}

void RigidContact::settle(Local& local, bool arrives) {
  const double tolerance = arrives ? config_.tolerance : std::max(kOnTheWay, config_.tolerance);
  const int most = arrives ? config_.max_iterations : std::min(kMostOnTheWay, config_.max_iterations);
  const auto size = elastic_.free_count();
  local.now = body_.forces();
  local.solved = body_.factor().solve(local.now.force);
  bool stale = false;
  bool fresh = false;
  for (int round = 0;; ++round) {
    if (stale) renew(local);
    fresh = stale;
    look(local);
    if (layer_.rubs() && round > 0) layer_.hold(local.near, placed_, local.places);
    local.press = layer_.press(local.near, placed_, local.places, Layer::Order::kFelt);
    local.curve = local.press.curve(local.rows, local.rows);
    local.curve_held = local.curve;
    local.held = Local::factor(local.stiffness, local.curve_held);
    double force = 0;
    double stiffness = 0;
    for (std::size_t t = 0; t < tools_.size(); ++t) {
      force = std::max(force, local.press.felt[t].slope.head<3>().norm());
      stiffness = std::max(stiffness, stiffest(local, t));
    }
    const double enough = tolerance * force + (force > 0 ? kToolUnseen : kUnfelt) * stiffness;

    const VectorXd free = -pairs_.times(local.now.force, local.solved);
    VectorXd step = free;
    if (!local.unknowns.empty()) {
      const VectorXd by = meet(local, free(local.unknowns), kMet * enough * enough / stiffness);
      step -= by_near(local, local.stiffness * (free(local.unknowns) - by));
    }
    const double slope = (local.now.force + local.spread(local.slope(), size)).dot(step);
    error_ = std::sqrt(std::abs(slope) * stiffness);
    const bool good = error_ <= enough && (round > 0 || !layer_.rubs());
    if (error_ <= enough) in_vain_ = 0;
    if (good || round == most) break;
    stale = !fresh && in_vain_ >= kToolPatience;
    if (stale) continue;
    const VectorXd before = local.now.force;
    const VectorXd start = elastic_.to_free(body_.displacements());
    const bool moved = go(step, slope, local);
    stale = !moved && !fresh;
    if (stale) continue;
    if (!moved && !layer_.rubs()) break;
    ++iterations_;
    ++in_vain_;
    const VectorXd solved = body_.factor().solve(local.now.force);
    const VectorXd change = local.now.force - before;
    if (change.norm() > kToolHeard * local.now.force.norm()) {
      pairs_.add(elastic_.to_free(body_.displacements()) - start, change, solved - local.solved);
    }
    local.solved = solved;
  }
  if (layer_.rubs()) dissipated_ = layer_.advance(local.near, placed_, local.places);
}

VectorXd RigidContact::needed(const Local& local, const VectorXd& shape) {
  const double nudge = kToolNudge / shape.lpNorm<Eigen::Infinity>();
  if (!std::isfinite(nudge)) return VectorXd::Zero(shape.size());
  body_.move(nudge * shape);
  VectorXd all = (body_.forces().force - local.now.force) / nudge;
  body_.move(-nudge * shape);
  all(local.unknowns) += local.curve * shape(local.unknowns);
  return all;
}

/// K = Π_pp − Π_pu Π_uu⁻¹ Π_up. The approximate inverse is improved by conjugate gradients, so its error is squared.
Layer::Mat6 RigidContact::curve(const Local& local, std::size_t tool) {
  const Layer::Felt& felt = local.press.felt[tool];
  const int motions = config_.turns ? 6 : 3;
  MatrixXd loads(elastic_.free_count(), motions);
  for (int c = 0; c < motions; ++c) {
    loads.col(c) = local.spread(felt.mixed.col(c)(local.rows), elastic_.free_count());
  }
  MatrixXd shapes(loads.rows(), motions);
  const MatrixXd by_factor = body_.factor().solve(loads);
  for (int c = 0; c < motions; ++c) shapes.col(c) = solve(local, loads.col(c), by_factor.col(c));
  const MatrixXd guess = felt.curve.topLeftCorner(motions, motions) - loads.transpose() * shapes;
  MatrixXd left(loads.rows(), motions);
  for (int c = 0; c < motions; ++c) {
    const double scale = guess.block(c / 3 * 3, c / 3 * 3, 3, 3).norm();
    VectorXd rest = loads.col(c) - needed(local, shapes.col(c));
    VectorXd better = solve(local, rest, body_.factor().solve(rest));
    VectorXd way = better;
    double gain = rest.dot(better);
    for (int round = 0; round < kCurveRounds && std::abs(gain) > kCurveError * scale; ++round) {
      const VectorXd by_way = needed(local, way);
      const double bend = way.dot(by_way);
      if (!(bend > 0) || !(gain > 0)) break;  // not stable
      shapes.col(c) += gain / bend * way;
      rest -= gain / bend * by_way;
      better = solve(local, rest, body_.factor().solve(rest));
      const double next = rest.dot(better);
      way = better + next / gain * way;
      gain = next;
    }
    left.col(c) = rest;
  }
  const MatrixXd k =
      felt.curve.topLeftCorner(motions, motions) - loads.transpose() * shapes - shapes.transpose() * left;
  Layer::Mat6 all = Layer::Mat6::Zero();
  all.topLeftCorner(motions, motions) = (k + k.transpose()) / 2;
  return all;
}

Feel RigidContact::feel(const Local& local, std::size_t tool) {
  Feel feel;
  feel.gap = std::numeric_limits<double>::infinity();
  if (config_.turns) feel.torque.emplace();
  if (!placed_[tool].handle) return feel;
  const Layer::Felt& felt = local.press.felt[tool];
  feel.touching = felt.area > 0;
  const Layer::Gap gap = layer_.gap(placed_[tool], feel.touching ? rest_ : body_.displacements());
  feel.gap = gap.value - layer_.thickness();
  feel.normal = gap.normal;
  feel.error = error_;
  if (!feel.touching) {
    feel.valid_radius = std::max(0.0, feel.gap);
    return feel;
  }
  feel.force = -felt.slope.head<3>();
  feel.normal = feel.force.normalized();
  const Layer::Mat6 k = curve(local, tool);
  feel.stiffness = k.topLeftCorner<3, 3>();
  if (feel.torque) {
    feel.torque->torque = -felt.slope.tail<3>();
    feel.torque->stiffness = not_negative(k.bottomRightCorner<3, 3>());
  }
  feel.valid_radius = std::max(layer_.thickness(), felt.spread / 4);
  return feel;
}

double RigidContact::longest_step() const {
  double most = layer_.least_facet() / 2;
  for (const HeldTool& tool : tools_) most = std::min(most, tool.shape.thinnest() / 8);
  return most;
}

/// Moves the tool out of the body.
void RigidContact::put_down(std::size_t tool, const Pose& handle) {
  placed_[tool].handle = handle;
  for (int i = 0; i < kFarthest; ++i) {
    if (layer_.gap(placed_[tool], body_.displacements()).value > layer_.thickness()) return;
    placed_[tool].handle->position += layer_.least_facet() / 2 * from_;
  }
}

std::vector<Feel> RigidContact::press(std::span<const std::optional<Pose>> handles) {
  expect(handles.size() == tools_.size(), "handles", static_cast<double>(handles.size()), "one for each tool");
  std::vector<std::optional<Pose>> to(handles.begin(), handles.end());
  std::vector<bool> lost(to.size());
  for (std::size_t t = 0; t < to.size(); ++t) {
    lost[t] = to[t] && !finite(*to[t]);
    if (lost[t]) to[t] = placed_[t].handle;
  }
  std::vector<Feel> feels(to.size());
  for (Feel& feel : feels) feel.gap = std::numeric_limits<double>::infinity();
  if (std::ranges::find(lost, false) == lost.end()) return feels;

  const double most = longest_step();
  const auto way = [&](std::size_t t) {
    const HeldTool& tool = tools_[t];
    const Pose& from = *placed_[t].handle;
    const double angle = Eigen::AngleAxisd(Mat3(to[t]->turn * from.turn.transpose())).angle();
    return (tool.middle(*to[t]) - tool.middle(from)).norm() + angle * tool.shape.reach();
  };
  double longest = 0;
  for (std::size_t t = 0; t < to.size(); ++t) {
    if (!to[t]) placed_[t].handle.reset();
    if (!to[t]) continue;
    if (!placed_[t].handle || way(t) > kMostSteps * most) put_down(t, *to[t]);
    longest = std::max(longest, way(t));
  }
  const int steps = std::max(1, static_cast<int>(std::ceil(longest / most)));
  std::vector<std::optional<Pose>> from;
  for (const Layer::Placed& placed : placed_) from.push_back(placed.handle);
  iterations_ = 0;
  Local local;
  for (int i = 1; i <= steps; ++i) {
    for (std::size_t t = 0; t < to.size(); ++t) {
      if (to[t]) placed_[t].handle = i < steps ? between(*from[t], *to[t], static_cast<double>(i) / steps) : *to[t];
    }
    settle(local, i == steps);
  }
  for (std::size_t t = 0; t < to.size(); ++t) {
    if (!lost[t]) feels[t] = feel(local, t);
  }
  return feels;
}

std::size_t RigidContact::bytes() const noexcept {
  return layer_.bytes() + pairs_.bytes() + column_of_.size() * sizeof(int) +
         static_cast<std::size_t>(follows_.size() + rest_.size()) * sizeof(double);
}

}  // namespace tendon::softbody
