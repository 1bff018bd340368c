// SPDX-License-Identifier: Apache-2.0
#include "tests/lab/felt.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/lab/paper.h"

namespace tendon::lab {
namespace {

constexpr Duration kLength = std::chrono::seconds(3);
constexpr Friction kDevice{.coulomb = 0.02, .viscous = 0.26};

/// An engine's last answer: force and stiffness of it are asked for one after the other.
class Answers {
 public:
  explicit Answers(softbody::Body& body) : body_(body) {}
  const softbody::Feel& at(const Vec3& tool) {
    if (tool != asked_) feel_ = body_.touch(asked_ = tool);
    return feel_;
  }

 private:
  softbody::Body& body_;
  Vec3 asked_ = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  softbody::Feel feel_;
};

/// How far the hand is below the surface, m.
double depth_at(double t, double deepest) {
  const double turn = 2 * std::numbers::pi * t;
  return deepest * (0.37 - 0.47 * std::cos(0.8 * turn) + 0.13 * std::sin(2.3 * turn));
}

/// Share of the true stiffness, over the time in which there is something to feel.
double displayed(const std::vector<Moment>& record, double surface) {
  double shown = 0;
  double right = 0;
  for (const Moment& m : record) {
    const double depth = surface - m.position.z();
    if (depth <= 0) continue;
    shown += m.step.force.z() * depth;
    right += m.true_force.z() * depth;
  }
  return shown / right;
}

double relative_error(const Outcome& outcome) { return outcome.force_error / outcome.true_force; }

}  // namespace

Felt felt(softbody::Body& body, Truth& truth, const Route& route, std::uint64_t seed) {
  const Vec3 surface = truth.block().touch_point();
  const double deepest = truth.block().loads[1] / truth.stiffness(1).secant;
  Answers answers(body);

  Experiment set;
  set.environment.force = [&](double, const Vec3& tool) { return answers.at(tool).force; };
  set.environment.truth = [&](double, const Vec3& tool) { return truth.force(tool); };
  set.environment.route = route;
  set.limiter = {.law = Law::kAolPlus, .friction = kDevice, .parts = default_parts(kPaperEncoder)};
  set.max_force = kPaperMaxForce;
  set.length = kLength;
  set.seed = seed;
  set.hand = PrescribedMotion{
      .position = [&](double t) { return Vec3(surface - Vec3(0, 0, depth_at(t, deepest))); },
      .friction = kDevice,
      .encoder_step = kPaperEncoder,
  };

  Felt result;
  result.held_error = relative_error(outcome(run(set), set.period));
  set.environment.stiffness = [&](double, const Vec3& tool) { return answers.at(tool).stiffness; };
  const std::vector<Moment> record = run(set);
  const Outcome followed = outcome(record, set.period);
  result.displayed = displayed(record, surface.z());
  result.force_error = relative_error(followed);
  result.limited_share = followed.limited_share;
  result.latency = followed.latency;

  FreeHand hand = paper_hand(kDevice);
  hand.hand->motion = ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.6 * deepest,
                                                          .frequency = 0.8,
                                                          .centre = surface - Vec3(0, 0, 0.4 * deepest),
                                                          .direction = Vec3::UnitZ()});
  set.hand = hand;
  result.vibration = outcome(run(set), set.period).late_vibration;
  return result;
}

}  // namespace tendon::lab
