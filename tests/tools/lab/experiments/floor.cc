// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/floor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "core/base/expect.h"
#include "core/ledger/output_bound.h"
#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/lab/pictures/csv.h"

namespace tendon::lab {
namespace {

constexpr double kStart = 1e-6;        // J, E₀
constexpr double kFirstBarrier = 4;    // of F_max²; with a smaller one the first steps get stuck at the boundary
constexpr double kLastBarrier = 1e-8;  // N²
constexpr double kFewer = 0.3;         // ratio of successive barriers
constexpr int kMostSteps = 400;        // Newton steps per barrier
constexpr double kInfinite = std::numeric_limits<double>::infinity();

struct Loss {
  double value = 0, slope = 0, curvature = 0;
};

class Programme {
 public:
  Programme(const FloorProblem& problem, Passive sense) : problem_(problem), sense_(sense), n_(problem.truth.size()) {
    const double hold = seconds(problem.period);
    earned_.resize(n_);
    for (std::size_t k = 0; k < n_; ++k) {
      const double d = std::abs(problem.dx[k]);
      earned_[k] = problem.friction.coulomb * d + problem.friction.viscous * d * d / hold;
    }
  }

  Floor solve() {
    std::vector<double> force(n_, 0.0);
    double barrier = kFirstBarrier * problem_.max_force * problem_.max_force;
    bool centred = false;
    for (; barrier > kLastBarrier; barrier *= kFewer) centred = centre(force, barrier);
    Floor floor{.force = force};
    double error = 0;
    double truth = 0;
    for (std::size_t k = 0; k < n_; ++k) {
      error += (force[k] - problem_.truth[k]) * (force[k] - problem_.truth[k]);
      truth += problem_.truth[k] * problem_.truth[k];
    }
    // Three constraints per force: the account and both limits.
    const double gap = 3 * static_cast<double>(n_) * barrier / kFewer;
    floor.error = std::sqrt(error / truth);
    floor.at_least = centred ? std::sqrt(std::max(0.0, error - gap) / truth) : 0.0;
    return floor;
  }

 private:
  Loss loss(std::size_t k, double force) const {
    if (sense_ == Passive::kOnThisMotion) return {};
    const double hold = seconds(problem_.period);
    OutputBound bound = OutputBound::of(problem_.friction, problem_.period);
    const double sign = force < 0 ? -1.0 : 1.0;
    if (sense_ == Passive::kAccelerating) {
      const double towards = k > 0 ? sign * problem_.dx[k - 1] / hold : 0.0;
      bound.reach = hold * (towards + problem_.acceleration * hold);
    }
    const double size = std::abs(force);
    Loss result{.value = bound.at(size), .slope = sign * bound.slope(size)};
    const bool reaches = bound.slope(size) >= bound.reach;
    if (result.slope != 0 && !reaches) result.curvature = 1 / (2 * bound.viscous_per_hold);
    return result;
  }

  std::vector<double> accounts(const std::vector<double>& force) const {
    std::vector<double> energy(n_);
    energy[0] = kStart;
    for (std::size_t k = 0; k + 1 < n_; ++k) energy[k + 1] = energy[k] - force[k] * problem_.dx[k] + earned_[k];
    return energy;
  }

  double merit(const std::vector<double>& force, const std::vector<double>& energy, double barrier) const {
    double sum = 0;
    for (std::size_t k = 0; k < n_; ++k) {
      const double left = energy[k] - loss(k, force[k]).value;
      const double room = problem_.max_force * problem_.max_force - force[k] * force[k];
      if (left <= 0 || room <= 0) return kInfinite;
      const double miss = force[k] - problem_.truth[k];
      sum += miss * miss - barrier * (std::log(left) + std::log(room));
    }
    return sum;
  }

  /// One barrier; returns whether Newton's method converged. The backward pass computes the cost-to-go P E² + 2 p E,
  /// the forward pass the forces.
  bool centre(std::vector<double>& force, double barrier) const {
    std::vector<double> energy = accounts(force);
    std::vector<double> constant(n_);
    std::vector<double> feedback(n_);
    for (int step = 0; step < kMostSteps; ++step) {
      double square = 0;
      double line = 0;
      for (std::size_t k = n_; k-- > 0;) {
        const Loss l = loss(k, force[k]);
        const double left = energy[k] - l.value;
        const double room = problem_.max_force * problem_.max_force - force[k] * force[k];
        const double gradient =
            2 * (force[k] - problem_.truth[k]) + barrier * l.slope / left + 2 * barrier * force[k] / room;
        const double curvature = 2 + barrier * (l.slope * l.slope / left / left + l.curvature / left) +
                                 barrier * (2 / room + 4 * force[k] * force[k] / room / room);
        const double mixed = -barrier * l.slope / left / left;
        const double travel = k + 1 < n_ ? problem_.dx[k] : 0.0;
        const double h = curvature + square * travel * travel;
        const double g = gradient - line * travel;
        const double c = mixed - square * travel;
        constant[k] = -g / h;
        feedback[k] = -c / h;
        square += barrier / left / left - c * c / h;
        line += -barrier / left - c * g / h;
      }
      std::vector<double> change(n_);
      double ahead = 0;
      for (std::size_t k = 0; k < n_; ++k) {
        change[k] = constant[k] + feedback[k] * ahead;
        ahead -= problem_.dx[k] * change[k];
      }
      const double before = merit(force, energy, barrier);
      double share = 1;
      double after = kInfinite;
      for (; share > 1e-6; share /= 2) {
        std::vector<double> tried(n_);
        for (std::size_t k = 0; k < n_; ++k) tried[k] = force[k] + share * change[k];
        std::vector<double> then = accounts(tried);
        after = merit(tried, then, barrier);
        if (after >= before) continue;
        force = std::move(tried);
        energy = std::move(then);
        break;
      }
      // Converged: no decrease beyond double precision, or hardly any in a full step.
      double slope = 0;
      for (std::size_t k = 0; k < n_; ++k) slope += std::abs(change[k]);
      if (after >= before) return slope < 1e-3 * static_cast<double>(n_);
      if (before - after < 1e-2 * barrier && share == 1) return true;
    }
    return false;
  }

  const FloorProblem& problem_;
  Passive sense_;
  std::size_t n_;
  std::vector<double> earned_;  ///< J, by friction during each hold
};

}  // namespace

Floor floor_of(const FloorProblem& problem, Passive sense) {
  expect_above_zero(seconds(problem.period), "period");
  expect_above_zero(problem.friction.viscous, "friction.viscous");
  expect_above_zero(problem.max_force, "max_force");
  expect_above_zero(problem.acceleration, "acceleration");
  if (problem.dx.size() != problem.truth.size() || problem.dx.empty()) {
    throw std::invalid_argument("a floor requires as many forces as travels, at least one: got " +
                                std::to_string(problem.truth.size()) + " and " + std::to_string(problem.dx.size()));
  }
  const auto finite = [](double value) { return std::isfinite(value); };
  if (!std::ranges::all_of(problem.dx, finite) || !std::ranges::all_of(problem.truth, finite)) {
    throw std::invalid_argument("dx and truth: expected finite numbers");
  }
  if (std::ranges::all_of(problem.truth, [](double force) { return force == 0; })) {
    throw std::invalid_argument("truth: expected a force other than zero, because errors are relative to it");
  }
  return Programme(problem, sense).solve();
}

std::optional<double> floor_of(const std::vector<Moment>& record, const Friction& friction, Duration period,
                               double max_force, Passive sense) {
  FloorProblem problem{.friction = friction, .period = period, .max_force = max_force};
  bool any = false;
  for (std::size_t k = 0; k < record.size(); ++k) {
    if (record[k].position.tail<2>() != Eigen::Vector2d(record[0].position.tail<2>())) return std::nullopt;
    if (record[k].true_force.tail<2>() != Eigen::Vector2d::Zero()) return std::nullopt;
    problem.dx.push_back(k + 1 < record.size() ? record[k + 1].position.x() - record[k].position.x() : 0.0);
    problem.truth.push_back(record[k].true_force.x());
    any = any || record[k].true_force.x() != 0;
  }
  if (!any) return std::nullopt;
  return floor_of(problem, sense).error;
}

FloorProblem on_perfect_spring(double stiffness, const Friction& friction, bool firm) {
  constexpr int kFiner = 50;  // 50 kHz, at which sampling of the spring is negligible
  FreeHand hand = paper_hand(friction);
  hand.encoder_step.reset();
  hand.hand->motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.015, .frequency = 0.5});
  if (firm) {
    hand.hand->stiffness = 800;
    hand.hand->damping = 3;
    hand.hand->mass = 0.1;
  }
  Experiment set;
  set.period = std::chrono::microseconds(1000 / kFiner);
  set.environment = {.force = [stiffness](double, const Vec3& x) { return Vec3(-stiffness * x); },
                     .period = set.period};
  set.hand = hand;
  set.limiter = {.law = Law::kNone, .friction = friction};
  set.length = std::chrono::seconds(2);
  set.max_force = kPaperMaxForce;
  const std::vector<Moment> record = run(set);
  FloorProblem problem{.friction = friction, .period = std::chrono::milliseconds(1), .max_force = kPaperMaxForce};
  for (std::size_t i = 0; i + kFiner < record.size(); i += kFiner) {
    problem.dx.push_back(record[i + kFiner].position.x() - record[i].position.x());
    problem.truth.push_back(-stiffness * record[i].position.x());
  }
  return problem;
}

void floors(const FloorOptions& options, std::ostream& out) {
  constexpr std::array kFrictions = {Friction{.coulomb = 0.02, .viscous = 0.26},
                                     Friction{.coulomb = 0.04, .viscous = 0.05},
                                     Friction{.coulomb = 0.04, .viscous = 0.005}};
  constexpr std::array kSprings = {100.0, 300.0, 500.0, 1000.0, 2000.0, 8000.0};
  constexpr std::array kSenses = {std::pair{Passive::kOnThisMotion, "on this motion"},
                                  std::pair{Passive::kWhateverComes, "whatever comes"},
                                  std::pair{Passive::kAccelerating, "below 300 m/s2"}};
  CsvTable table(options.command);
  if (!options.json) {
    out << "Least error of any law, % of the true force, for a loose / firm hand on the ideal spring, 2 s; commit "
        << kCommit << "\n\npassive          b N s/m";
    for (const double stiffness : kSprings) {
      std::array<char, 32> text{};
      std::snprintf(text.data(), text.size(), "%8.0f N/m", stiffness);
      out << text.data();
    }
    out << "\n";
  }
  for (const auto& [sense, name] : kSenses) {
    for (const Friction& friction : kFrictions) {
      std::array<char, 64> text{};
      std::snprintf(text.data(), text.size(), "%-16s %7g", name, friction.viscous);
      if (!options.json) out << text.data();
      for (const double stiffness : kSprings) {
        std::array<double, 2> percent{};
        for (const bool firm : {false, true}) {
          const Floor floor = floor_of(on_perfect_spring(stiffness, friction, firm), sense);
          percent[firm ? 1 : 0] = floor.error * 100;
          JsonLine json;
          json.add("passive", name)
              .add("b_n_s_per_m", friction.viscous)
              .add("fc_n", friction.coulomb)
              .add("stiffness_n_per_m", stiffness)
              .add("hand", firm ? "firm" : "loose")
              .add("floor_percent", floor.error * 100)
              .add("at_least_percent", floor.at_least * 100)
              .add("commit", kCommit);
          table.add(json);
          if (options.json) out << json.str() << "\n";
        }
        std::snprintf(text.data(), text.size(), "%6.0f /%3.0f ", percent[0], percent[1]);
        if (!options.json) out << text.data();
      }
      if (!options.json) out << "\n" << std::flush;
    }
  }
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    table.write(*options.out / "floor.csv");
  }
  if (!out.flush()) throw std::runtime_error("cannot write: is the disk full?");
}

}  // namespace tendon::lab
