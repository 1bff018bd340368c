// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/contact.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/haptic_controller.h"
#include "tests/support/dice.h"
#include "tests/support/property_cases.h"
#include "tests/tools/lab/experiments/steps.h"
#include "tests/tools/lab/recordings/run_summary.h"

namespace tendon::lab::contact_test {
namespace {

using testing::spring_run;
using testing::step_at;

struct Springs {
  Vec3 normal = Vec3::UnitX();
  double stiffness = 0;  // N/m
  std::optional<double> above{};
  std::optional<double> below{};

  /// In m. The value is positive beyond `above` and negative below `below`.
  double pressed(const Vec3& position) const {
    const double s = position.dot(normal);
    if (above && s > *above) return s - *above;
    if (below && s < *below) return s - *below;
    return 0;
  }
  Vec3 force(const Vec3& position) const { return -stiffness * pressed(position) * normal; }
};

class Drawn {
 public:
  explicit Drawn(std::uint64_t seed) : dice_(seed) {
    draw();
    simulate();
  }

  const std::vector<StepRecord>& steps() const { return steps_; }

  /// Operational stiffness by the definition of RunObserver, from the true positions of the springs.
  double stiffness() const {
    double deepest = 0;
    for (const auto& [depth, secant] : felt_) deepest = std::max(deepest, depth);
    double sum = 0;
    double count = 0;
    for (const auto& [depth, secant] : felt_) {
      if (depth <= 0.1 * deepest) continue;
      sum += secant;
      ++count;
    }
    return sum / count;
  }
  double deepest() const {
    double deepest = 0;
    for (const auto& [depth, secant] : felt_) deepest = std::max(deepest, depth);
    return deepest;
  }
  /// Forces are fresh and follow the hand, so the felt stiffness is that of the springs.
  bool is_near() const { return delay_ <= 1 && every_ <= 2; }
  double drawn_stiffness() const { return springs_.stiffness; }
  std::string text() const {
    return "k " + std::to_string(springs_.stiffness) + " delay " + std::to_string(delay_) + " every " +
           std::to_string(every_) + " led " + std::to_string(static_cast<int>(leads_)) + " noise " +
           std::to_string(noise_) + " amplitude " + std::to_string(amplitude_) + " slide " + std::to_string(slide_) +
           " above " + std::to_string(springs_.above.value_or(9) - middle_) + " below " +
           std::to_string(springs_.below.value_or(9) - middle_) + " deepest " + std::to_string(deepest()) + " from " +
           std::to_string(from_) + " to " + std::to_string(until_);
  }

 private:
  enum class Leads : std::uint8_t { kNobody, kEngine, kWrongEngine, kLearned };

  void draw() {
    springs_.normal =
        dice_.chance(0.6) ? Vec3(Vec3::Unit(static_cast<Eigen::Index>(dice_.bits() % 3))) : dice_.direction();
    aside_ = springs_.normal.unitOrthogonal();
    springs_.stiffness = dice_.decades(1.7, 3.5);
    middle_ = dice_.within(-0.05, 0.05);
    amplitude_ = dice_.within(0.003, 0.015);
    frequency_ = dice_.decades(-0.7, 0.3);
    phase_ = dice_.within(0, 6.28);
    slide_ = dice_.chance(0.3) ? dice_.within(0, 0.03) : 0;
    const double place = middle_ + amplitude_ * dice_.within(-0.9, 0.5);
    const double kind = dice_.uniform();
    if (kind < 0.35) {
      springs_.above = place;
    } else if (kind < 0.7) {
      springs_.below = 2 * middle_ - place;
    } else if (kind < 0.85) {
      springs_.below = springs_.above = place;
    } else {
      springs_.above = middle_ + amplitude_ * dice_.within(0.1, 0.7);
      springs_.below = middle_ - amplitude_ * dice_.within(0.1, 0.9);
    }
    delay_ = dice_.chance(0.6) ? dice_.bits() % 2 : dice_.bits() % 40;
    every_ = dice_.chance(0.5) ? 1 : 1 + dice_.bits() % 12;
    leads_ = static_cast<Leads>(dice_.bits() % 4);
    noise_ = dice_.chance(0.5) ? 0 : dice_.within(0, 0.02) * springs_.stiffness * amplitude_;
    count_ = dice_.chance(0.5) ? 0 : dice_.within(0, 30e-6);
    overruns_ = dice_.chance(0.5) ? 0 : dice_.within(0, 0.005);
    length_ = 2000 + dice_.bits() % 6000;
    const bool is_short = dice_.chance(0.3);
    from_ = is_short ? dice_.bits() % (length_ / 2) : dice_.bits() % 300;
    until_ = is_short ? from_ + 600 + dice_.bits() % 1000 : length_;
  }

  Vec3 place_of(double t) const {
    const double w = 2 * std::numbers::pi;
    const double s = middle_ + amplitude_ * std::sin(w * frequency_ * t + phase_) + 1e-4 * std::sin(w * 9 * t);
    return s * springs_.normal + slide_ * std::sin(w * 0.37 * frequency_ * t) * aside_;
  }

  double counted(double x) const { return count_ > 0 ? count_ * std::round(x / count_) : x; }

  void answer(HapticController& controller, const Motion& motion, LocalTime now, std::uint64_t n) {
    RemoteForce force;
    force.sequence = n + 1;
    force.answers_tick = n;
    force.answers = motion.at;
    force.received = now;
    force.force = springs_.force(motion.position) + dice_.within(-1, 1) * noise_ * springs_.normal;
    force.valid_for = std::chrono::milliseconds(100);
    if (leads_ == Leads::kEngine || leads_ == Leads::kWrongEngine) {
      const double wrong = leads_ == Leads::kWrongEngine ? 0.85 : 1;
      const double slope = springs_.pressed(motion.position) != 0 ? wrong * springs_.stiffness : 0;
      force.model.emplace();
      force.model->at = motion.position;
      force.model->stiffness = slope * springs_.normal * springs_.normal.transpose();
    }
    controller.observe(force);
  }

  void simulate() {
    HapticController::Config config;
    config.limiter = {.law = Law::kNone, .friction = {.coulomb = 0.1, .viscous = 1}, .longest_hold = testing::kPeriod};
    config.max_force = 1e4;
    config.max_slew = 1e9;
    if (leads_ == Leads::kEngine || leads_ == Leads::kWrongEngine) config.hold.adaptive_local_model.emplace();
    if (leads_ == Leads::kLearned) config.hold.learned_model.emplace();
    HapticController controller(config);
    std::uint64_t at = 0;  // ms
    for (std::uint64_t n = 0; n < length_; ++n) {
      at += dice_.chance(overruns_) ? 5 + dice_.bits() % 60 : 1;
      StepRecord step = step_at(at);
      const Vec3 real = place_of(static_cast<double>(at) * 1e-3);
      const Motion hand{.at = step.hand.at,
                        .position = Vec3(counted(real.x()), counted(real.y()), counted(real.z())),
                        .velocity = Vec3::Zero()};
      if (n >= from_ && n < until_ && n >= delay_ && n % every_ == 0) {
        answer(controller, delay_ == 0 ? hand : steps_[n - delay_].hand, hand.at, n);
      }
      static_cast<Step&>(step) = controller.step(hand, steps_.empty() ? Vec3(Vec3::Zero()) : steps_.back().applied);
      step.tick = n;
      step.applied = step.force;
      steps_.push_back(step);
      const double pressed = springs_.pressed(real);
      const bool fresh = step.mode == Mode::kActive || step.mode == Mode::kHolding;
      if (n < until_ && fresh && !step.reasons.has(Reason::kRampIn) && pressed != 0)
        felt_.emplace_back(std::abs(pressed), -step.applied.dot(springs_.normal) / pressed);
    }
  }

  Dice dice_;
  Springs springs_;
  Vec3 aside_ = Vec3::UnitY();
  double middle_ = 0;     // m
  double amplitude_ = 0;  // m
  double frequency_ = 1;  // Hz
  double phase_ = 0;
  double slide_ = 0;         // m, lateral
  std::uint64_t delay_ = 0;  // steps
  std::uint64_t every_ = 1;  // steps
  Leads leads_ = Leads::kNobody;
  double noise_ = 0;     // N
  double count_ = 0;     // m, encoder resolution; 0: exact
  double overruns_ = 0;  // fraction of steps
  std::uint64_t length_ = 0;
  std::uint64_t from_ = 0;  // first and last step with the engine
  std::uint64_t until_ = 0;
  std::vector<StepRecord> steps_;
  std::vector<std::pair<double, double>> felt_;  // depth, m; secant, N/m
};

TEST(Contact, TheStiffnessIsRightWithinAFewPercentOrNotMeasurable) {
  constexpr double kWithin = 0.05;
  constexpr double kShallow = 5e-4;  // m
  int drawn = 0;
  int measured = 0;
  int wrong = 0;
  int deep = 0;
  std::string which;
  for (int seed = 0; seed < property_cases() / 4; ++seed) {
    const Drawn run(static_cast<std::uint64_t>(seed));
    ++drawn;
    const RunSummary summary = summarise(run.steps());
    if (run.deepest() > kShallow) ++deep;
    if (!summary.operational_stiffness) continue;
    ++measured;
    const double expected = run.is_near() ? run.drawn_stiffness() : run.stiffness();
    const double error = *summary.operational_stiffness / expected - 1;
    if (std::abs(error) <= kWithin) continue;
    ++wrong;
    which += "seed " + std::to_string(seed) + ": " + std::to_string(*summary.operational_stiffness) + " for " +
             std::to_string(expected) + " N/m (" + run.text() + ")\n";
  }
  EXPECT_LE(wrong, measured / 100) << "of " << drawn << ":\n" << which;
  EXPECT_GE(measured, 3 * deep / 4) << "what is never said is never wrong";
}

TEST(Contact, PullsWhereAContactEndsAreNoContactOnTheOtherSide) {
  auto steps = spring_run(4000, 1165, 0, 0);
  for (StepRecord& step : steps) {
    const double x = step.hand.position.x();
    const bool leaves = step.hand.velocity.x() < 0;
    if (leaves && x < 0 && x > -6e-4) step.wanted.x() = step.applied.x() = 0.3;
  }
  const RunSummary run = summarise(steps);
  ASSERT_TRUE(run.contact && run.contact->above);
  EXPECT_FALSE(run.contact->below) << *run.contact->below;
  EXPECT_NEAR(run.operational_stiffness.value_or(0), 1165, 0.03 * 1165);
}

std::vector<Push> pushes_of(const Springs& springs, double from, double to) {
  std::vector<Push> pushes;
  for (int i = 0; i <= 1000; ++i) {
    const Vec3 place = (from + (to - from) * i / 1000) * springs.normal;
    pushes.push_back({place, place, springs.force(place)});
  }
  return pushes;
}

TEST(Contact, OfASlotBothSidesAreFoundHoweverUnevenlyTheyArePushed) {
  const Springs slot{.stiffness = 1000, .above = 0.002, .below = -0.002};
  const auto contact = find_contact(pushes_of(slot, -0.0025, 0.02), Vec3::UnitX());
  ASSERT_TRUE(contact && contact->above && contact->below);
  EXPECT_NEAR(*contact->above, 0.002, 1e-6);
  EXPECT_NEAR(*contact->below, -0.002, 1e-6);
}

TEST(Contact, OneWildForceHidesNoContact) {
  const Springs wall{.stiffness = 1000, .above = 0.002};
  auto pushes = pushes_of(wall, -0.01, 0.01);
  pushes[3].force.x() = -1e12;
  const auto contact = find_contact(pushes, Vec3::UnitX());
  ASSERT_TRUE(contact && contact->above);
  EXPECT_NEAR(*contact->above, 0.002, 1e-4);
}

TEST(Contact, AWallAcrossTheMotionIsMeasuredAlongItsNormal) {
  const Springs wall{.normal = Vec3(1, 1, 0).normalized(), .stiffness = 800, .above = 0.001};
  std::vector<StepRecord> steps;
  for (std::uint64_t n = 0; n < 4000; ++n) {
    StepRecord step = step_at(n);
    const double t = static_cast<double>(n) * 1e-3;
    step.hand.position = 0.004 * std::sin(6 * t) * wall.normal + 0.03 * std::sin(2 * t) * Vec3::UnitZ();
    step.force_sequence = n + 1;
    step.wanted = step.applied = wall.force(step.hand.position);
    steps.push_back(step);
  }
  const RunSummary run = summarise(steps);
  EXPECT_NEAR(run.axis.dot(wall.normal), 1, 1e-6);
  EXPECT_NEAR(run.operational_stiffness.value_or(0), 800, 8);
}

TEST(Contact, AHandThatNeverLeavesAStrangeContactMeasuresNothing) {
  std::vector<Push> pushes;
  std::vector<FeltStep> felt;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 place((1 + 1e-4 * i) * Vec3::UnitX());
    pushes.push_back({place, place, Vec3(-5 - 0.001 * i, 0, 0)});
    felt.push_back({place, pushes.back().force});
  }
  const auto contact = find_contact(pushes, Vec3::UnitX());
  ASSERT_TRUE(contact);
  EXPECT_FALSE(felt_stiffness(felt, Vec3::UnitX(), *contact));
}

TEST(Contact, AThinSkinIsNoContactThatGoesOnBehindIt) {
  std::vector<Push> pushes;
  for (int i = 0; i < 1000; ++i) {
    const Vec3 place = 2e-5 * (i - 500) * Vec3::UnitX();
    pushes.push_back({place, place, i > 500 && i < 600 ? Vec3(-0.02 * (i - 500), 0, 0) : Vec3(0, 0, 0)});
  }
  EXPECT_FALSE(find_contact(pushes, Vec3::UnitX()));
}

}  // namespace
}  // namespace tendon::lab::contact_test
