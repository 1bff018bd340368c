// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/felt.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <vector>

#include "tests/tools/lab/experiments/meter.h"
#include "tests/tools/lab/experiments/paper.h"

namespace tendon::lab {
namespace {

constexpr Duration kTrialLength = std::chrono::seconds(3);
constexpr Friction kDevice{.coulomb = 0.02, .viscous = 0.26};

/// Each answer has a force and a stiffness. Between two, a dynamic body advances by the elapsed time, as in
/// tendon-softbody, while its tool moves continuously, because a jump would strike the surface. A slow engine falls
/// behind.
class Answers {
 public:
  /// `compute`: s, time of the engine per step of a dynamic body, or per answer of a static one.
  Answers(PressedEngine& engine, double compute, double longest)
      : engine_(engine), pace_(std::max(engine.step(), compute)), longest_(longest) {}

  void restart() {
    given_.clear();
    again();
  }

  /// Restarts time for the same hand, with cached answers.
  void again() {
    went_on_to_ = 0;
    asked_at_ = -1;
    asked_.reset();
    next_ = 0;
  }

  const softbody::Feel& at(double t, const Vec3& tool) {
    if (t == asked_at_ && tool == asked_) return feel_;
    if (engine_.took(meter_.read() - start_) > longest_)
      throw TooSlow("computing the error at the hand takes too long");
    if (next_ < given_.size() && given_[next_].t == t && given_[next_].tool == tool) {
      feel_ = given_[next_++].feel;
    } else {
      go_on(t, tool);
    }
    asked_at_ = t;
    asked_ = tool;
    return feel_;
  }

 private:
  struct Answer {
    double t;  ///< s
    Vec3 tool;
    softbody::Feel feel;
  };

  void go_on(double t, const Vec3& tool) {
    const Vec3 from = asked_.value_or(tool);
    const double steps = engine_.step() > 0 ? std::max(1.0, std::floor((t - went_on_to_) / pace_)) : 1;
    for (double step = 1; step <= steps; ++step) feel_ = engine_.touch(from + step / steps * (tool - from));
    went_on_to_ += steps * pace_;
    given_.resize(next_++);  // later answers belong to another hand
    given_.push_back({t, tool, feel_});
  }

  PressedEngine& engine_;
  double pace_;     ///< s
  double longest_;  ///< s
  Meter meter_;
  Meter::Reading start_ = meter_.read();
  double went_on_to_ = 0;  ///< s
  double asked_at_ = -1;   ///< s
  std::optional<Vec3> asked_;
  softbody::Feel feel_;
  std::vector<Answer> given_;
  std::size_t next_ = 0;  ///< of them
};

/// m, below the surface.
double depth_at(double t, double deepest) {
  const double turn = 2 * std::numbers::pi * t;
  return deepest * (0.37 - 0.47 * std::cos(0.8 * turn) + 0.13 * std::sin(2.3 * turn));
}

/// Displayed fraction of the true stiffness while in contact.
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

Felt felt(PressedEngine& engine, Truth& truth, const Route& route, std::uint64_t seed, double longest_s) {
  const Vec3 surface = truth.block().touch_point();
  const double deepest = truth.block().loads[1] / truth.stiffness(1).secant;
  Answers answers(engine, seconds(route.compute), longest_s);

  Experiment set;
  set.environment.force = [&](double t, const Vec3& tool) { return answers.at(t, tool).force; };
  set.environment.truth = [&](double, const Vec3& tool) { return truth.force(tool); };
  set.environment.route = route;
  set.limiter = {.law = Law::kAolPlus, .friction = kDevice, .parts = default_parts(kPaperEncoder)};
  set.max_force = kPaperMaxForce;
  set.length = kTrialLength;
  set.seed = seed;
  set.hand = PrescribedMotion{
      .position = [&](double t) { return Vec3(surface - Vec3(0, 0, depth_at(t, deepest))); },
      .friction = kDevice,
      .encoder_step = kPaperEncoder,
  };

  Felt result;
  result.held_error = relative_error(outcome(run(set), set.period));
  set.environment.stiffness = [&](double t, const Vec3& tool) { return answers.at(t, tool).stiffness; };
  answers.again();
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
  set.environment.truth = [](double, const Vec3&) { return Vec3::Zero().eval(); };  // only vibration is evaluated
  answers.restart();
  result.vibration = outcome(run(set), set.period).late_vibration;
  return result;
}

}  // namespace tendon::lab
