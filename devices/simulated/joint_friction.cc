// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/joint_friction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "core/base/expect.h"

namespace tendon {
namespace {

using Turns = std::array<int, 3>;  ///< the sign of each joint's velocity

struct Stiction {
  Turns turns;
  Vec3 impulse;
  double wrong = std::numeric_limits<double>::infinity();  ///< violation of the friction law, as a velocity
};

/// Friction for given `turns`: velocity = free − coupling · impulse.
Stiction sticking(const Turns& turns, const Mat3& coupling, const Vec3& free, const Vec3& most, const Turns& known) {
  Mat3 equations = Mat3::Identity();
  Vec3 right;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const int turn = turns[static_cast<std::size_t>(i)];
    if (turn == 0) equations.row(i) = coupling.row(i);
    right[i] = turn == 0 ? free[i] : turn * most[i];
  }
  Stiction stiction{turns, equations.inverse() * right};
  const Vec3 velocity = free - coupling * stiction.impulse;
  stiction.wrong = 0;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto joint = static_cast<std::size_t>(i);
    if (turns[joint] == 0) {
      stiction.wrong = std::max(stiction.wrong, (std::abs(stiction.impulse[i]) - most[i]) * coupling(i, i));
    } else if (known[joint] == 0) {
      stiction.wrong = std::max(stiction.wrong, -turns[joint] * velocity[i]);
    }
  }
  return stiction;
}

/// Returns the unique impulse with |impulseᵢ| ≤ mostᵢ. If joint i moves, its impulse is opposite to the velocity and
/// |impulseᵢ| = mostᵢ. The nonzero entries of `known` are given. Uses the best of 27 cases, because of rounding.
Stiction stiction_of(const Mat3& coupling, const Vec3& free, const Vec3& most, const Turns& known = {}) noexcept {
  Stiction best;
  const auto holds = [&](Turns turns) {
    for (std::size_t i = 0; i < turns.size(); ++i) {
      if (known[i] != 0) turns[i] = known[i];
    }
    const Stiction stiction = sticking(turns, coupling, free, most, known);
    if (stiction.wrong < best.wrong) best = stiction;
    return stiction.wrong <= 0;
  };
  const auto sign = [](double x) { return (x > 0 ? 1 : 0) - (x < 0 ? 1 : 0); };
  if (holds({sign(free[0]), sign(free[1]), sign(free[2])})) return best;  // usual while sliding
  if (holds({})) return best;
  for (int code = 0; code < 27; ++code) {
    const auto digit = [code](int place) { return code / place % 3 - 1; };
    if (holds({digit(1), digit(3), digit(9)})) break;
  }
  return best;
}

/// Returns the velocity closest to `v` without motion of the joints that are 0 in `turns`.
Vec3 standing(const Turns& turns, const Mat3& jacobian, const Vec3& v) {
  if (turns == Turns{}) return Vec3::Zero();
  const Mat3 coupling = jacobian * jacobian.transpose();
  const Vec3 turning = jacobian * v;
  Mat3 equations = Mat3::Identity();
  Vec3 right = Vec3::Zero();
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (turns[static_cast<std::size_t>(i)] != 0) continue;
    equations.row(i) = coupling.row(i);
    right[i] = turning[i];
  }
  return v - jacobian.transpose() * (equations.inverse() * right);
}

}  // namespace

JointFriction::JointFriction(const Config& config)
    : mechanism_(config.mechanism), centre_(config.centre), coulomb_(config.coulomb), viscous_(config.viscous) {
  expect_finite(centre_, "joint_friction.centre");
  for (Eigen::Index i = 0; i < 3; ++i) {
    const std::string joint = '[' + std::to_string(i) + ']';
    expect_not_negative(coulomb_[i], "joint_friction.coulomb" + joint);
    expect_not_negative(viscous_[i], "joint_friction.viscous" + joint);
  }
  expect(coulomb_.sum() + viscous_.sum() > 0, "joint_friction.coulomb", 0,
         "friction in at least one joint (omit joint_friction if there is none)");
}

Friction JointFriction::least() const noexcept {
  const Vec3& levers = mechanism_.levers();
  const bool everywhere = viscous_.minCoeff() > 0;
  return {.coulomb = coulomb_.cwiseQuotient(levers).minCoeff(),
          .viscous = everywhere ? 1 / levers.cwiseAbs2().cwiseQuotient(viscous_).sum() : 0};
}

Friction JointFriction::least_at(const Vec3& position) const noexcept {
  const Mat3 jacobian = mechanism_.jacobian(position - centre_);
  const Vec3 levers = jacobian.inverse().colwise().norm().transpose();
  const Mat3 viscous = jacobian.transpose() * viscous_.asDiagonal() * jacobian;
  const Eigen::SelfAdjointEigenSolver<Mat3> solved(viscous, Eigen::EigenvaluesOnly);
  return {.coulomb = coulomb_.cwiseQuotient(levers).minCoeff(), .viscous = std::max(0.0, solved.eigenvalues()[0])};
}

Vec3 JointFriction::torques(const Mechanism::Kind& mechanism, double coulomb) {
  const Vec3 levers = Mechanism(mechanism).levers();
  Vec3 torques = coulomb * levers;
  // Rounding must not reduce `coulomb`, which is used as a lower bound.
  for (Eigen::Index i = 0; i < 3; ++i) {
    while (torques[i] / levers[i] < coulomb) torques[i] = std::nextafter(torques[i], HUGE_VAL);
  }
  return torques;
}

JointFriction::Slide JointFriction::step(const Vec3& position, const Vec3& v0, const Impetus& impetus,
                                         double h) const noexcept {
  const Mat3 jacobian = mechanism_.jacobian(position - centre_);
  const Mat3 viscous = jacobian.transpose() * viscous_.asDiagonal() * jacobian;  // N·s/m
  const Mat3 mobility = (impetus.resistance * Mat3::Identity() + h / 2 * viscous).inverse();
  const Mat3 spread = jacobian * mobility;

  const Stiction stiction = stiction_of(spread * jacobian.transpose(), spread * impetus.momentum, h / 2 * coulomb_);
  Slide slide;
  slide.mean = stiction.turns == Turns{}
                   ? Vec3(Vec3::Zero())
                   : Vec3(mobility * (impetus.momentum - jacobian.transpose() * stiction.impulse));
  slide.end = 2 * slide.mean - v0;

  Turns known = stiction.turns;
  const Vec3 turning = jacobian * slide.end;
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (turning[static_cast<Eigen::Index>(i)] * known[i] <= 0) known[i] = 0;
  }
  const auto some = [](const Turns& turns) { return std::find(turns.begin(), turns.end(), 0) != turns.end(); };
  if (!some(known)) return slide;
  const double drag = (impetus.resistance - impetus.mass) * 2 / h;
  const Vec3 push = impetus.push - drag * slide.mean - viscous * slide.mean;
  const Stiction rest = stiction_of(jacobian * jacobian.transpose(), jacobian * push, coulomb_, known);
  if (some(rest.turns)) slide.end = standing(rest.turns, jacobian, slide.end);
  return slide;
}

Joints JointFriction::at(const Motion& hand) const noexcept {
  const Vec3 position = hand.position - centre_;
  return Joints::three(mechanism_.angles(position), mechanism_.jacobian(position) * hand.velocity);
}

void JointFriction::name(std::vector<std::string>& joints) const {
  const auto names = mechanism_.joints();
  joints.assign(names.begin(), names.end());
}

}  // namespace tendon
