// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/learned.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>
#include <span>
#include <string>
#include <utility>

#include "clients/softbody/fem/products.h"
#include "clients/softbody/fem/sparse.h"
#include "clients/softbody/near/least_squares.h"

namespace tendon::softbody {
namespace {

/// The maximum numbers of shapes, and the part of the energy (square root) that may be neglected.
constexpr std::array<int, 2> kMostLearned{45, 60};
constexpr double kShapesLeft = 3e-4;
constexpr double kGoodEnough = 0.015;  ///< the second number is used above this relative error with the first

constexpr double kElementsLeft = 5e-3;      ///< accepted error of the chosen elements
constexpr int kMostElements = 240;          ///< their maximum number
constexpr Eigen::Index kCandidates = 1500;  ///< only the elements with the largest nonlinear parts are considered

constexpr double kNudged = 1e-6;      ///< step of finite differences, relative to |q|
constexpr double kLeastNudge = 1e-9;  ///< √J, its minimum

constexpr int kMostSteps = 8;                ///< maximum number of steps of Newton's method
constexpr double kShortestShare = 1.0 / 64;  ///< the shortest step
constexpr double kShareOfDecrease = 1e-4;    ///< Armijo's parameter
constexpr double kLeastCurved = 1e-8;        ///< minimum cosine between a step and its change of forces

constexpr double kForNewton = 0.25;  ///< fraction of the tolerance for Newton's method

constexpr double kExactly = 1e-6;  ///< relative tolerance for knots; the error of the force is quadratic
constexpr double kJudged = 1e-4;   ///< for validation

constexpr int kStiffnessRounds = 5;       ///< maximum number of rounds of the Rayleigh quotient
constexpr double kStiffnessAlike = 0.02;  ///< its accepted relative error

/// Elements do not share corners here, so their forces are separate.
Kernel apart(const Solid& solid, Law law, const std::vector<int>& elements, const std::vector<int>& node_of,
             const VectorXd& weights) {
  const int per_element = nodes_of(solid.mesh().shape);
  Kernel kernel(law, per_element, solid.points_per_element());
  for (std::size_t k = 0; k < elements.size(); ++k) {
    const auto own = std::span(node_of).subspan(k * at(per_element), at(per_element));
    kernel.add_element(own);
    for (int q = 0; q < solid.points_per_element(); ++q) {
      const Solid::Part part = solid.part(elements[k], q);
      const double size = weights[static_cast<Eigen::Index>(k)] * part.point.volume;
      kernel.set_point(static_cast<int>(k), q, part.gradient, size * part.point.mu, size * part.point.lambda);
    }
  }
  return kernel;
}

struct Corners {  // the nodes of some elements, and their indices for each corner
  Corners(const Mesh& mesh, const std::vector<int>& elements) {
    for (const int element : elements) {
      for (const int node : mesh.element(element)) nodes.push_back(node);
    }
    std::ranges::sort(nodes);
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    for (const int element : elements) {
      for (const int node : mesh.element(element)) {
        own.push_back(static_cast<int>(std::ranges::lower_bound(nodes, node) - nodes.begin()));
      }
    }
  }
  std::vector<int> nodes;
  std::vector<int> own;
};

MatrixXd rows_of(const Solid& solid, const MatrixXd& free, const std::vector<int>& nodes) {
  MatrixXd rows = MatrixXd::Zero(3 * static_cast<Eigen::Index>(nodes.size()), free.cols());
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const int component = solid.free_of(3 * nodes[static_cast<std::size_t>(i / 3)] + static_cast<int>(i % 3));
    if (component >= 0) rows.row(i) = free.row(component);
  }
  return rows;
}

struct Basis {  // shapes that are orthonormal with the stiffness at rest
  MatrixXd shapes;
  MatrixXd q;
};

Basis basis_of(const std::vector<const SolvedPress*>& presses, const SymmetricMatrix& at_rest, int most) {
  const auto count = static_cast<Eigen::Index>(presses.size());
  MatrixXd all(at_rest.size, count);
  VectorXd sizes(count);
  for (Eigen::Index s = 0; s < count; ++s) {
    const VectorXd& shape = presses[static_cast<std::size_t>(s)]->shape;
    // A compromise between equal weights and equal errors (m), because deep presses have special shapes.
    sizes[s] = std::sqrt(shape.norm());
    all.col(s) = shape / sizes[s];
  }
  MatrixXd gram(count, count);
  for (Eigen::Index s = 0; s < count; ++s) gram.col(s) = all.transpose() * at_rest.times(all.col(s));
  const Eigensystem parts = eigensystem((gram + gram.transpose()) / 2);
  const VectorXd& energies = parts.values;
  Eigen::Index kept = std::min<Eigen::Index>(count, most);
  const double sum = energies.sum();
  const auto left = [&](Eigen::Index of) { return energies.head(count - of).cwiseMax(0.0).sum(); };
  while (kept > 1 && left(kept - 1) <= kShapesLeft * kShapesLeft * sum) --kept;
  const MatrixXd mix = parts.vectors.rightCols(kept) * energies.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
  return {all * mix, mix.transpose() * gram * sizes.asDiagonal()};
}

class Added {  // the nonlinear part of the forces for each element
 public:
  Added(const Solid& solid, const Basis& basis)
      : basis_(basis), elements_(static_cast<std::size_t>(solid.mesh().element_count())) {
    std::iota(elements_.begin(), elements_.end(), 0);
    corners_ = std::make_unique<Corners>(solid.mesh(), elements_);
    rows_ = rows_of(solid, basis.shapes, corners_->nodes).transpose();
    std::vector<int> single(corners_->own.size());
    std::iota(single.begin(), single.end(), 0);
    const VectorXd ones = VectorXd::Ones(static_cast<Eigen::Index>(elements_.size()));
    law_ = std::make_unique<Kernel>(apart(solid, solid.law(), elements_, single, ones));
    linear_ = std::make_unique<Kernel>(apart(solid, Law::kLinear, elements_, single, ones));
    per_element_ = nodes_of(solid.mesh().shape);
  }

  MatrixXd at_press(Eigen::Index s) const {
    const VectorXd u = rows_.transpose() * basis_.q.col(s);
    const auto size = 3 * static_cast<Eigen::Index>(corners_->own.size());
    VectorXd single(size);
    for (Eigen::Index i = 0; i < size; ++i) single[i] = u[row(i)];
    VectorXd force = VectorXd::Zero(size);
    law_->add_forces(single, force);
    VectorXd linear = VectorXd::Zero(size);
    linear_->add_forces(single, linear);
    force -= linear;
    MatrixXd all = MatrixXd::Zero(rows_.rows(), static_cast<Eigen::Index>(elements_.size()));
    const Eigen::Index per_element = 3 * per_element_;
    for (Eigen::Index i = 0; i < size; ++i) all.col(i / per_element) += force[i] * rows_.col(row(i));
    return all;
  }

 private:
  Eigen::Index row(Eigen::Index i) const { return 3 * corners_->own[static_cast<std::size_t>(i / 3)] + i % 3; }

  const Basis& basis_;
  std::vector<int> elements_;
  std::unique_ptr<Corners> corners_;
  MatrixXd rows_;
  std::unique_ptr<Kernel> law_;
  std::unique_ptr<Kernel> linear_;
  int per_element_ = 0;
};

void choose_elements(const Solid& solid, const Basis& basis, LearnedShapes& learned) {
  const Added added(solid, basis);
  const Eigen::Index presses = basis.q.cols();
  const Eigen::Index count = solid.mesh().element_count();
  VectorXd sizes = VectorXd::Zero(count);
  VectorXd scales(presses);
  Squares squares;
  for (Eigen::Index s = 0; s < presses; ++s) {
    const MatrixXd all = added.at_press(s);
    const VectorXd sum = all.rowwise().sum();
    scales[s] = 1 / (basis.q.col(s) + sum).norm();
    sizes += scales[s] * scales[s] * all.colwise().squaredNorm().transpose();
    squares.square += scales[s] * scales[s] * sum.squaredNorm();
  }
  std::vector<int> candidates(static_cast<std::size_t>(count));
  std::iota(candidates.begin(), candidates.end(), 0);
  if (count > kCandidates) {
    std::ranges::stable_sort(candidates, [&](int a, int b) { return sizes[a] > sizes[b]; });
    candidates.resize(static_cast<std::size_t>(kCandidates));
    std::ranges::sort(candidates);
  }
  const auto among = static_cast<Eigen::Index>(candidates.size());
  squares.gram = MatrixXd::Zero(among, among);
  squares.right = VectorXd::Zero(among);
  for (Eigen::Index s = 0; s < presses; ++s) {
    const MatrixXd all = scales[s] * added.at_press(s);
    const MatrixXd some = all(Eigen::all, candidates);
    squares.gram.selfadjointView<Eigen::Lower>().rankUpdate(some.transpose());
    squares.right += some.transpose() * all.rowwise().sum();
  }
  squares.gram = squares.gram.selfadjointView<Eigen::Lower>();
  const VectorXd weights = few_not_negative(squares, kElementsLeft, kMostElements);
  std::vector<double> chosen;
  for (Eigen::Index i = 0; i < among; ++i) {
    if (!(weights[i] > 0)) continue;
    learned.elements.push_back(candidates[static_cast<std::size_t>(i)]);
    chosen.push_back(weights[i]);
  }
  learned.weights = Eigen::Map<const VectorXd>(chosen.data(), static_cast<Eigen::Index>(chosen.size()));
}

MatrixXd curvature_at(const LearnedBody& body, const VectorXd& q) {
  const Eigen::Index size = q.size();
  const double nudge = std::max(kLeastNudge, kNudged * q.norm());
  VectorXd before(size);
  VectorXd after(size);
  MatrixXd all(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    VectorXd there = q;
    there[i] += nudge;
    body.energy(there, after);
    there[i] -= 2 * nudge;
    body.energy(there, before);
    all.col(i) = (after - before) / (2 * nudge);
  }
  return (all + all.transpose()) / 2;
}

bool stable_at_held_depth(const MatrixXd& curvature, const VectorXd& load) {
  const VectorXd along = load.normalized();
  const MatrixXd held = MatrixXd::Identity(load.size(), load.size()) - along * along.transpose();
  const MatrixXd across = held * curvature * held + along * along.transpose();
  return eigensystem((across + across.transpose()) / 2, false).values[0] > 0;
}

/// The line search of Newton's method. `slope` is updated.
bool go(const LearnedBody& body, const VectorXd& step, double& energy, VectorXd& q, VectorXd& slope) {
  const double foreseen = slope.dot(step);
  VectorXd there_slope(q.size());
  for (double share = 1; share >= kShortestShare; share /= 2) {
    const VectorXd there = q + share * step;
    const double there_energy = body.energy(there, there_slope);
    if (there_energy - energy > kShareOfDecrease * share * foreseen + 1e-14 * std::abs(energy)) continue;
    q = there;
    energy = there_energy;
    slope.swap(there_slope);
    return true;
  }
  return false;
}

void learn_step(const VectorXd& step, const VectorXd& change, MatrixXd& inverse) {  // BFGS
  const double stiff = step.dot(change);
  if (!(stiff > kLeastCurved * step.norm() * change.norm())) return;
  const VectorXd solved = inverse * change;
  const VectorXd mixed = ((1 + change.dot(solved) / stiff) / 2 * step - solved) / stiff;
  inverse += mixed * step.transpose() + step * mixed.transpose();
}

bool solve_knot(const LearnedBody& body, const VectorXd& load, double depth, VectorXd& q, MatrixXd& inverse) {
  VectorXd slope(q.size());
  for (int i = 0; i < kMostSteps; ++i) {
    const MatrixXd curvature = curvature_at(body, q);
    if (!curvature.allFinite()) return false;
    inverse = curvature.partialPivLu().inverse();
    inverse = (inverse + inverse.transpose()).eval() / 2;
    const VectorXd by_tool = inverse * load;
    q += (depth - load.dot(q)) / load.dot(by_tool) * by_tool;
    double energy = body.energy(q, slope);
    const double force = by_tool.dot(slope) / load.dot(by_tool);
    const VectorXd step = force * by_tool - inverse * slope;
    const double error = std::sqrt(std::abs(slope.dot(step) / load.dot(by_tool)));
    if (error <= kExactly * std::abs(force)) return stable_at_held_depth(curvature, load);
    if (!(slope.dot(step) < 0) || !go(body, step, energy, q, slope)) return false;
  }
  return false;
}

double share_of(double found, double truth) { return std::abs(found / truth - 1); }

}  // namespace

namespace {

LearnedShapes learn_shapes_of(const Solid& solid, const TouchSurface& surface, const SolvedPresses& presses, int most,
                              const Tell& tell) {
  const PressGrid& grid = presses.grid;
  std::vector<const SolvedPress*> good;
  for (const SolvedPress& press : presses.knots) {
    if (press.shape.size() > 0) good.push_back(&press);
  }
  SymmetricMatrix at_rest = solid.pattern();
  solid.stiffness(VectorXd::Zero(solid.size()), Elastic::Curvature::kExact, at_rest);
  const Basis basis = basis_of(good, at_rest, most);
  if (tell) tell("learning: " + std::to_string(basis.shapes.cols()) + " shapes of " + std::to_string(good.size()));
  LearnedShapes learned{.grid = grid};
  choose_elements(solid, basis, learned);
  const Corners corners(solid.mesh(), learned.elements);
  learned.shapes = rows_of(solid, basis.shapes, corners.nodes);
  const MatrixXd touched = rows_of(solid, basis.shapes, surface.nodes());
  learned.depths.resize(basis.shapes.cols(), touched.rows() / 3);
  for (Eigen::Index i = 0; i < learned.depths.cols(); ++i) {
    learned.depths.col(i) = -(surface.normal().transpose() * touched.middleRows<3>(3 * i)).transpose();
  }
  const Kernel linear = apart(solid, Law::kLinear, learned.elements, corners.own, learned.weights);
  const auto count = basis.shapes.cols();
  MatrixXd few(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    VectorXd force = VectorXd::Zero(learned.shapes.rows());
    linear.add_forces(learned.shapes.col(i), force);
    few.col(i) = learned.shapes.transpose() * force;
  }
  learned.linear = MatrixXd::Identity(count, count) - (few + few.transpose()) / 2;
  if (tell)
    tell("learning: " + std::to_string(learned.elements.size()) + " elements of " +
         std::to_string(solid.mesh().element_count()));

  learned.knots = MatrixXd::Zero(count, grid.knots());
  learned.inverses = MatrixXd::Zero(count, count * grid.knots());
  std::vector<double> at_knots(at(grid.knots()), -1);
  const LearnedBody nothing_known(solid, surface, learned);
  Eigen::Index next = 0;
  for (int i = 0; i < grid.places(); ++i) {
    const int along = i / grid.side();
    const auto patch = surface.patch(grid.place(along, i % grid.side()));
    for (int level = 0; level <= PressGrid::kLevels; ++level) {
      const int knot = i * (PressGrid::kLevels + 1) + level;
      auto inverse = learned.inverses.middleCols(count * knot, count);
      inverse.setIdentity();
      if (!patch) continue;
      const VectorXd load = nothing_known.load(*patch);
      const SolvedPress& truth = presses.knots[at(knot)];
      if (level == 0) {
        at_knots[at(knot)] = share_of(1 / load.squaredNorm(), truth.reaction.stiffness);
        continue;
      }
      if (!truth.good) continue;
      VectorXd q = basis.q.col(next++);
      MatrixXd found(count, count);
      if (!solve_knot(nothing_known, load, level * grid.step, q, found)) continue;
      learned.knots.col(knot) = q;
      inverse = found;
      VectorXd slope(count);
      nothing_known.energy(q, slope);
      const VectorXd by_tool = found * load;
      at_knots[at(knot)] = share_of(by_tool.dot(slope) / load.dot(by_tool), truth.reaction.force);
    }
  }
  const LearnedBody body(solid, surface, learned);
  std::vector<double> in_middles(at(grid.cells()), -1);
  for (int i = 0; i < 2 * grid.around; ++i) {
    for (int j = 0; j < 2 * grid.around; ++j) {
      const Vec2 place = grid.place(i + 0.5, j + 0.5);
      const auto patch = surface.patch(place);
      for (int level = 0; patch && level < PressGrid::kLevels; ++level) {
        const int cell = grid.cell(i, j, level);
        const SolvedPress& truth = presses.middles[at(cell)];
        const double depth = (level + 0.5) * grid.step;
        const auto found = body.press(*patch, depth, *grid.find(place, depth), kJudged);
        if (!truth.good || !found) continue;
        in_middles[at(cell)] = share_of(found->force, truth.reaction.force);
        if (level > 0) continue;
        const double rest = share_of(1 / body.load(*patch).squaredNorm(), presses.at_rest[at(grid.column(i, j))]);
        in_middles[at(cell)] = std::max(in_middles[at(cell)], rest);
      }
    }
  }
  learned.errors = Trust(grid, at_knots, in_middles).errors();
  return learned;
}

}  // namespace

LearnedShapes learn_shapes(const Solid& solid, const TouchSurface& surface, const SolvedPresses& presses,
                           const Tell& tell) {
  LearnedShapes learned;
  for (const int most : kMostLearned) {
    learned = learn_shapes_of(solid, surface, presses, most, tell);
    const bool good =
        std::ranges::all_of(learned.errors, [](double error) { return !std::isfinite(error) || error <= kGoodEnough; });
    if (good || learned.linear.rows() < most) break;
  }
  return learned;
}

LearnedBody::LearnedBody(const Solid& solid, const TouchSurface& surface, const LearnedShapes& learned)
    : grid_(learned.grid),
      kernel_(
          apart(solid, solid.law(), learned.elements, Corners(solid.mesh(), learned.elements).own, learned.weights)),
      shapes_(MatrixXd::Zero((learned.shapes.rows() + 3) / 4 * 4, learned.shapes.cols())),
      depths_(learned.depths),
      column_of_(solid.mesh().nodes.size(), -1),
      linear_(learned.linear),
      knots_(learned.knots),
      inverses_(learned.inverses) {
  shapes_.topRows(learned.shapes.rows()) = learned.shapes;
  for (std::size_t i = 0; i < surface.nodes().size(); ++i) column_of_[at(surface.nodes()[i])] = static_cast<int>(i);
}

double LearnedBody::energy(const VectorXd& q, VectorXd& slope) const {
  VectorXd u;
  times(shapes_, q, u);
  VectorXd force = VectorXd::Zero(u.size());
  const double of_law = kernel_.add_forces(u, force);
  times_transposed(shapes_, force, slope);
  const VectorXd linear = linear_ * q;
  slope += linear;
  return of_law + q.dot(linear) / 2;
}

MatrixXd LearnedBody::depths_below(const Patch& patch) const {
  MatrixXd below(shapes(), static_cast<Eigen::Index>(patch.nodes.size()));
  for (Eigen::Index i = 0; i < below.cols(); ++i) {
    below.col(i) = depths_.col(column_of_[at(patch.nodes[static_cast<std::size_t>(i)])]);
  }
  return below;
}

VectorXd LearnedBody::load(const Patch& patch) const { return depths_below(patch) * patch.weights; }

std::optional<Reaction> LearnedBody::press(const Patch& patch, double depth, const PressGrid::Point& point,
                                           double tolerance) const {
  const MatrixXd below = depths_below(patch);
  const VectorXd load = below * patch.weights;
  const Eigen::Index size = shapes();
  VectorXd q = VectorXd::Zero(size);
  for (const auto& [knot, share] : grid_.around_point(point)) q += share * knots_.col(knot);
  MatrixXd inverse = MatrixXd::Zero(size, size);
  for (const auto& [knot, share] : grid_.corners(point)) inverse += share * inverses_.middleCols(size * knot, size);
  VectorXd by_tool = inverse * load;
  double compliance = load.dot(by_tool);
  q += (depth - load.dot(q)) / compliance * by_tool;
  VectorXd slope(size);
  double energy = this->energy(q, slope);
  Reaction reaction;
  reaction.way = SolverPath::kLearned;
  for (int step = 0;; ++step) {
    reaction.force = by_tool.dot(slope) / compliance;
    const VectorXd move = reaction.force * by_tool - inverse * slope;
    const double left = -slope.dot(move);
    reaction.error = std::sqrt(std::abs(left / compliance));
    if (reaction.error <= tolerance * std::abs(reaction.force)) break;
    const VectorXd from = q;
    const VectorXd before = slope;
    if (step == kMostSteps || !(left > 0) || !go(*this, move, energy, q, slope)) return std::nullopt;
    learn_step(q - from, slope - before, inverse);
    by_tool = inverse * load;
    compliance = load.dot(by_tool);
  }
  reaction.depth = load.dot(q);
  reaction.slope = patch.slopes * (below.transpose() * q);

  // The exact shape minimizes the stiffness (Rayleigh quotient).
  const double nudge = std::max(kLeastNudge, kNudged * q.norm());
  VectorXd there(size);
  const auto stiff = [&](const VectorXd& shape) {
    const double by = nudge / shape.norm();
    this->energy(q + by * shape, there);
    return VectorXd((there - slope) / by);
  };
  const auto held = [&](const VectorXd& b) {
    const VectorXd x = inverse * b;
    return VectorXd(x - load.dot(x) / compliance * by_tool);
  };
  VectorXd shape = by_tool / compliance;
  VectorXd by_shape = stiff(shape);
  reaction.stiffness = shape.dot(by_shape);
  double guess = 1 / compliance;
  for (int round = 0; std::abs(guess - reaction.stiffness) > kStiffnessAlike * std::abs(reaction.stiffness); ++round) {
    if (round == kStiffnessRounds) return std::nullopt;
    const VectorXd back = held(by_shape);
    const VectorXd by_back = stiff(back);
    const double share = back.dot(by_shape) / back.dot(by_back);
    shape -= share * back;
    by_shape -= share * by_back;
    guess = reaction.stiffness;
    reaction.stiffness = shape.dot(by_shape);
  }
  if (patch.curvatures.size() == 0) return reaction;
  const MatrixXd slopes = below * patch.slopes.transpose();
  MatrixXd shapes_of_slopes(size, 2);
  for (int axis = 0; axis < 2; ++axis) shapes_of_slopes.col(axis) = held(slopes.col(axis));
  const Vec3 curves = patch.curvatures * (below.transpose() * q);
  reaction.glide.tilting = slopes.transpose() * shape - shapes_of_slopes.transpose() * by_shape;
  reaction.glide.curving << curves[0], curves[1], curves[1], curves[2];
  const Mat2 giving = slopes.transpose() * shapes_of_slopes;
  reaction.glide.giving = (giving + giving.transpose()) / 2;
  reaction.knows_glide = true;
  return reaction;
}

std::size_t LearnedBody::bytes() const noexcept {
  return kernel_.bytes() + column_of_.size() * sizeof(int) +
         static_cast<std::size_t>(shapes_.size() + depths_.size() + linear_.size() + knots_.size() + inverses_.size()) *
             sizeof(double);
}

LearnedLevel::LearnedLevel(const Solid& solid, const TouchSurface& surface, const LearnedShapes& shapes,
                           double tolerance)
    : body_(solid, surface, shapes),
      trust_(shapes.grid, shapes.errors),
      allowed_(trust_, (1 - kForNewton) * tolerance),
      tolerance_(tolerance) {}

std::optional<FallbackLevel::Answer> LearnedLevel::press(const Patch& patch, double depth) const {
  const auto point = trust_.grid().find(patch.middle, depth);
  if (!point) return std::nullopt;
  const double share = allowed_.share(*point);
  if (!(share > 0)) return std::nullopt;
  auto reaction = body_.press(patch, depth, *point, kForNewton * tolerance_);
  if (!reaction) return std::nullopt;
  reaction->error += trust_.error(*point) * std::abs(reaction->force);
  return Answer{*reaction, share};
}

double LearnedLevel::room(const Vec2& middle, double depth) const {
  const auto point = trust_.grid().find(middle, depth);
  return point ? allowed_.room(*point) : 0;
}

FallbackLevel::Size LearnedLevel::size() const {
  Size size{.name = name_of(SolverPath::kLearned),
            .shapes = body_.shapes(),
            .elements = body_.elements(),
            .bytes = body_.bytes(),
            .cells = allowed_.cells(),
            .of_cells = static_cast<int>(trust_.errors().size())};
  for (const double error : trust_.errors()) {
    if (error <= (1 - kForNewton) * tolerance_) size.error = std::max(size.error, error + kForNewton * tolerance_);
  }
  return size;
}

}  // namespace tendon::softbody
