// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/self_test.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "protocol/expect.h"
#include "protocol/limits.h"

namespace tendon {
namespace {

using Verdict = SelfTest::Verdict;
using Finding = SelfTest::Finding;

constexpr double kNothingJ = 1e-12;  ///< J; with less work, the hand has not touched anything
/// Relative force difference between two answers at the same place, for engines that use single precision.
constexpr double kSameForce = 1e-6;
/// Relative kink above which a surface is near: the one-sided stiffnesses differ by more than 20 %.
constexpr double kSmoothKink = 0.1;

bool usable(const Touch& touch) {
  const auto fits = [](const auto& values) {
    return values.allFinite() && values.cwiseAbs().maxCoeff() <= limits::kMaxValue;
  };
  return fits(touch.force) && (!touch.stiffness || fits(*touch.stiffness));
}

std::string words(const Vec3& v, const char* unit) {
  std::ostringstream out;
  out << '(' << v.x() << ", " << v.y() << ", " << v.z() << ") " << unit;
  return out.str();
}

struct Unusable : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Hand {
 public:
  Hand(const Physics& engine, const SelfTestScript& script)
      : engine_(engine), script_(script), period_(from_seconds(1 / script.rate_hz)) {
    state_.position = script.start;
    state_.mode = Mode::kActive;
  }

  /// Throws Unusable if the position is finite but the answer is not.
  Touch at(const Vec3& position, const Vec3& velocity = Vec3::Zero()) {
    ++state_.tick;
    state_.sampled += period_;
    state_.position = position;
    state_.velocity = velocity;
    return again();
  }
  Touch again() const {
    Touch touch;
    try {
      touch = engine_(state_);
    } catch (const std::exception& error) {
      throw Unusable("exception \"" + std::string(error.what()) + "\" at " + words(state_.position, "m"));
    } catch (...) {
      throw Unusable("exception at " + words(state_.position, "m"));
    }
    if (state_.position.allFinite() && !usable(touch))
      throw Unusable("at " + words(state_.position, "m") + " the force is " + words(touch.force, "N"));
    return touch;
  }
  void pause(Duration time) { state_.sampled += time; }

  /// Moves to `to` on a straight line from rest to rest at most at `speed`; calls `each` with each position and answer.
  template <typename Each>
  void go(const Vec3& to, double speed, Each each) {
    const Vec3 from = state_.position;
    const double length = (to - from).norm();
    // x = from + (to − from)·(1 − cos(πs))/2 has its maximum speed in the middle, π/2 times the mean.
    const double time = std::numbers::pi / 2 * length / speed;
    const auto steps = std::max(1L, std::lround(time * script_.rate_hz));
    for (long i = 1; i <= steps; ++i) {
      const double angle = std::numbers::pi * static_cast<double>(i) / static_cast<double>(steps);
      const Vec3 position = i == steps ? to : Vec3(from + (to - from) * (1 - std::cos(angle)) / 2);
      each(position, at(position, (to - from) / length * speed * std::sin(angle)));
    }
  }
  const Vec3& position() const { return state_.position; }

 private:
  const Physics& engine_;
  const SelfTestScript& script_;
  Duration period_;
  DeviceState state_;
};

/// Integrates the work of a force along a path with the trapezoidal rule.
class WorkAlong {
 public:
  WorkAlong(const Vec3& position, const Vec3& force) : position_(position), force_(force) {}
  double to(const Vec3& position, const Vec3& force) {  // J
    const double part = (force_ + force).dot(position - position_) / 2;
    position_ = position;
    force_ = force;
    return part;
  }

 private:
  Vec3 position_;
  Vec3 force_;
};

struct Work {
  double given = 0;    ///< J, net energy from the engine to the hand so far
  double most = 0;     ///< J, maximum of `given` along the path
  double put_in = 0;   ///< J, work done by the hand, not reduced by returned energy
  double every_2 = 0;  ///< J, `given` computed from every second sample
  double largest_n = 0;
};

Work around(Hand& hand, std::vector<Vec3> corners, double speed) {
  corners.push_back(hand.position());
  const Vec3 first = hand.position();
  WorkAlong fine(first, hand.at(first).force);
  WorkAlong coarse = fine;
  Work work;
  for (const Vec3& corner : corners) {
    int places = 0;
    hand.go(corner, speed, [&](const Vec3& position, const Touch& touch) {
      const double part = fine.to(position, touch.force);
      work.given += part;
      work.most = std::max(work.most, work.given);
      work.put_in += std::max(-part, 0.0);
      work.largest_n = std::max(work.largest_n, touch.force.norm());
      if (++places % 2 == 0 || position == corner) work.every_2 += coarse.to(position, touch.force);
    });
  }
  return work;
}

class Tester {
 public:
  Tester(const Physics& engine, const SelfTestScript& script, const std::function<void(const Finding&)>& tell)
      : script_(script), tell_(tell), hand_(engine, script) {
    into_ = script.into.normalized();
    aside_[0] = into_.unitOrthogonal();
    aside_[1] = into_.cross(aside_[0]);
  }

  SelfTest run() {
    const Vec3 deep = script_.start + script_.depth * into_;
    for (const double speed : {script_.speed / 4, script_.speed}) {
      walk("press and release", {deep}, speed);
      for (const Vec3& aside : aside_) {
        const Vec3 away = script_.slide * aside;
        walk("press, slide, release", {deep, deep + away, script_.start + away}, speed);
        walk("the same in the opposite direction", {script_.start + away, deep + away, deep}, speed);
      }
      const Vec3 one = script_.slide * aside_[0];
      const Vec3 two = script_.slide * aside_[1];
      walk("slide in a square", {deep, deep + one, deep + one + two, deep + two, deep}, speed);
      walk("the same in the opposite direction", {deep, deep + two, deep + one + two, deep + one, deep}, speed);
    }
    if (!felt_)
      add(Verdict::kFailed, "is felt", "no force anywhere on the path: check start, into and depth of the script");
    judge_stiffness();
    judge_odd_states();
    return std::move(result_);
  }

 private:
  void add(Verdict verdict, std::string what, std::string why, double value = 0, double bound = 0) {
    result_.findings.push_back({verdict, std::move(what), std::move(why), value, bound});
    if (tell_) tell_(result_.findings.back());
  }

  void walk(const std::string& way, std::vector<Vec3> corners, double speed) {
    std::ostringstream name;
    name << way << ", " << speed << " m/s";
    const std::string route = name.str();
    const std::string claim = "generates no energy: " + route;
    try {
      const Work work = around(hand_, std::move(corners), speed);
      felt_ = felt_ || work.largest_n > 0;
      // Three times the trapezoidal-rule error: doubling the step quadruples the error (Richardson extrapolation).
      const double doubt = std::abs(work.given - work.every_2);
      const double bound = std::max(script_.work_tolerance * work.put_in + doubt, kNothingJ);
      std::ostringstream why;
      why << work.most << " J at most, " << work.given << " J at the end, of " << work.put_in << " J put in; up to "
          << bound << " J are allowed";
      add(work.most <= bound ? Verdict::kPassed : Verdict::kFailed, claim, why.str(), work.most, bound);
      if (script_.elastic) judge_loss(route, work, bound);
    } catch (const Unusable& error) {
      add(Verdict::kFailed, claim, error.what());
      hand_back();
    }
  }

  void judge_loss(const std::string& route, const Work& work, double bound) {
    const double lost = -work.given;
    std::ostringstream why;
    why << lost << " J of " << work.put_in << " J put in did not come back; up to " << bound << " J are allowed";
    add(lost <= bound ? Verdict::kPassed : Verdict::kFailed, "returns the stored energy: " + route, why.str(), lost,
        bound);
  }

  /// Moves to the start of the next test, ignoring errors.
  void hand_back() {
    try {
      hand_.at(script_.start);
    } catch (const Unusable&) {
      // already reported, or reported by the next test
    }
  }

  void judge_stiffness() {
    for (const double share : {0.25, 0.5, 0.75, 1.0}) {
      std::ostringstream claim;
      claim << "its stiffness matches its force, " << share * script_.depth << " m from the start";
      try {
        judge_stiffness_at(script_.start + share * script_.depth * into_, claim.str());
      } catch (const Unusable& error) {
        add(Verdict::kFailed, claim.str(), error.what());
      }
      hand_back();
    }
  }

  void judge_stiffness_at(const Vec3& place, const std::string& claim) {
    hand_.go(place, script_.speed, [](const Vec3&, const Touch&) {});
    // Rest for 0.2 s, so that the body settles.
    for (int i = 0; i < std::lround(script_.rate_hz / 5); ++i) hand_.at(place);
    const Touch touch = hand_.at(place);
    if (!touch.stiffness) return add(Verdict::kNotJudged, claim, "it provides no stiffness");
    const auto force_at = [&](const Vec3& position) { return hand_.at(position).force; };
    const FdStiffness found = fd_stiffness(force_at, place, script_.stiffness_step, script_.state).value();
    const double again = (hand_.at(place).force - touch.force).norm();
    if (!script_.state.save && again > kSameForce * std::max(touch.force.norm(), 1.0))
      return add(Verdict::kNotJudged, claim,
                 "its force does not only depend on the position: provide save and restore");
    const double size = found.stiffness.norm();
    if (found.kink > kSmoothKink * size) return add(Verdict::kNotJudged, claim, "there is a surface within the step");
    const Mat3 given = (*touch.stiffness + touch.stiffness->transpose()) / 2;
    const double off = (given - found.stiffness).norm();
    const double bound = script_.stiffness_tolerance * size + 2 * found.asymmetry + roundoff(touch.force);
    std::ostringstream why;
    why << "it differs by " << off << " N/m of " << size << " N/m; up to " << bound << " N/m are allowed";
    add(off <= bound ? Verdict::kPassed : Verdict::kFailed, claim, why.str(), off, bound);
  }

  /// N/m, roundoff error of a finite difference of single-precision forces.
  double roundoff(const Vec3& force) const {
    return std::numeric_limits<float>::epsilon() * force.norm() / script_.stiffness_step;
  }

  void judge_odd_states() {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const Vec3 deep = script_.start + script_.depth * into_;
    const auto odd = [&](const char* what, auto does) {
      const std::string claim = std::string("works after ") + what;
      try {
        does();
        hand_.at(script_.start);
        hand_.at(deep);
        hand_.at(script_.start);
        add(Verdict::kPassed, claim, "finite forces at the start and pressed");
      } catch (const Unusable& error) {
        add(Verdict::kFailed, claim, error.what());
      }
    };
    odd("a hand at NaN", [&] { hand_.at(Vec3::Constant(kNan), Vec3::Constant(kNan)); });
    odd("a hand at infinity", [&] { hand_.at(Vec3(kInfinity, 0, 0)); });
    odd("a hand 1 km away", [&] { hand_.at(1e3 * into_); });
    odd("a hand 1 km away in the opposite direction", [&] { hand_.at(-1e3 * into_); });
    odd("a denormal", [&] { hand_.at(Vec3::Constant(std::numeric_limits<double>::denorm_min())); });
    odd("the same state twice", [&] {
      hand_.at(deep);
      hand_.again();
    });
    odd("a second's pause", [&] {
      hand_.at(deep);
      hand_.pause(std::chrono::seconds(1));
      hand_.at(deep);
    });
  }

  const SelfTestScript& script_;
  const std::function<void(const Finding&)>& tell_;
  Hand hand_;
  Vec3 into_;
  std::array<Vec3, 2> aside_;
  bool felt_ = false;
  SelfTest result_;
};

}  // namespace

bool SelfTest::passed() const {
  return std::none_of(findings.begin(), findings.end(), [](const Finding& f) { return f.verdict == Verdict::kFailed; });
}

std::string SelfTest::Finding::text() const {
  const std::string first = verdict == Verdict::kPassed   ? "passed   "
                            : verdict == Verdict::kFailed ? "FAILED   "
                                                          : "unknown  ";
  return first + what + ": " + why + '\n';
}

std::string SelfTest::Finding::json() const {
  const char* const first = verdict == Verdict::kPassed ? "passed" : verdict == Verdict::kFailed ? "failed" : "unknown";
  const nlohmann::ordered_json line = {
      {"finding", {{"verdict", first}, {"what", what}, {"why", why}, {"value", value}, {"bound", bound}}}};
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + '\n';
}

std::string SelfTest::text() const {
  std::string text;
  for (const Finding& finding : findings) text += finding.text();
  return text;
}

std::string SelfTest::json() const {
  std::string text;
  for (const Finding& finding : findings) text += finding.json();
  return text;
}

SelfTest self_test(const Physics& engine, const SelfTestScript& script,
                   const std::function<void(const SelfTest::Finding&)>& tell) {
  expect_finite(script.start, "start");
  expect_above_zero(script.into.norm(), "into (its length)");
  expect_above_zero(script.depth, "depth");
  expect_above_zero(script.slide, "slide");
  expect_above_zero(script.speed, "speed");
  expect_above_zero(script.rate_hz, "rate_hz");
  expect(script.work_tolerance >= 0, "work_tolerance", script.work_tolerance, "0 or more");
  expect_above_zero(script.stiffness_step, "stiffness_step");
  expect(script.stiffness_tolerance >= 0, "stiffness_tolerance", script.stiffness_tolerance, "0 or more");
  if (!script.state.save != !script.state.restore) {
    throw std::invalid_argument("state: expected both save and restore, or neither");
  }
  return Tester(engine, script, tell).run();
}

}  // namespace tendon
