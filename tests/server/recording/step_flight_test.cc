// SPDX-License-Identifier: Apache-2.0
#include "server/recording/step_flight.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>
#include <random>
#include <stdexcept>
#include <vector>

#include "server/recording/recording_codec.h"
#include "tests/support/dice.h"

namespace tendon::step_flight_test {
namespace {

class Steps {
 public:
  explicit Steps(std::uint64_t seed) : random_(seed) {}

  /// Some values are not changed, and the others are random, including NaN and infinity.
  StepRecord next() {
    StepRecord step = last_;
    ++step.tick;
    step.scheduled += Duration(1'000'000);
    step.hand.at = step.scheduled + Duration(any() % 100'000);
    step.held = step.hand.at - last_.hand.at;
    step.was_applied = last_.applied;
    if (one_in(20)) step.tick += any() % 1000;
    if (one_in(20)) step.held = Duration(static_cast<Duration::rep>(any() >> 2U));
    change(step.was_applied);
    change(step.hand.position);
    change(step.hand.velocity);
    change(step.hand_force);
    change(step.wanted);
    for (int column = 0; column < 3; ++column) {
      Vec3 stiffness = step.stiffness.col(column);
      change(stiffness);
      step.stiffness.col(column) = stiffness;
    }
    change(step.permitted);
    step.force = step.wanted;
    change(step.force);
    step.applied = step.force;
    change(step.applied);
    change(step.energy);
    if (one_in(9)) step.longest_hold = Duration(static_cast<Duration::rep>(any()));
    if (one_in(3)) step.reasons = Reasons::from_bits(static_cast<std::uint32_t>(any()));
    if (one_in(3)) step.mode = static_cast<Mode>(1 + any() % 6);
    if (one_in(3)) step.force_way = static_cast<std::uint8_t>(any());
    if (one_in(9)) step.channel = static_cast<std::uint32_t>(any());
    if (one_in(2)) step.force_sequence += any() % 3;
    step.force_age = Duration(static_cast<Duration::rep>(any() % 2'000'000) - 1'000'000);
    if (one_in(9)) step.loop_age = Duration(static_cast<Duration::rep>(any()));
    change(step.force_error);
    step.rearmed = one_in(5);
    step.disarmed = one_in(5);
    if (one_in(5)) step.buttons = static_cast<std::uint32_t>(any());
    change_parts(step);
    last_ = step;
    return step;
  }

 private:
  std::uint64_t any() { return random_(); }
  bool one_in(std::uint64_t n) { return any() % n == 0; }
  void change(double& value) {
    switch (any() % 4) {
      case 0:
        value += 1e-9;
        break;
      case 1:
        value = std::bit_cast<double>(any());
        break;
      default:
        break;
    }
  }
  void change(Vec3& value) {
    for (double& part : value) change(part);
  }
  template <class Value>
  void change(std::optional<Value>& value) {
    if (one_in(4)) value.reset();
    if (one_in(2) && !value) value = Value{};
    if (value) change(*value);
  }
  void change(TurnStep& turn) {
    change(turn.hand.orientation.w);
    change(turn.hand.orientation.z);
    change(turn.hand.angular_velocity);
    change(turn.was_applied);
    change(turn.wanted);
    change(turn.torque);
    change(turn.applied);
  }
  void change(GripStep& grip) {
    for (double* value : {&grip.hand.opening, &grip.hand.velocity, &grip.was_applied, &grip.wanted, &grip.force,
                          &grip.applied, &grip.permitted, &grip.energy}) {
      change(*value);
    }
  }
  void change(Joints& joints) {
    joints.count = any() % (Joints::kMost + 1);
    for (double& angle : joints.angle) change(angle);
    for (double& velocity : joints.velocity) change(velocity);
  }
  void change(HandleStep& handle) {
    change(handle.turn);
    change(handle.grip);
    change(handle.joints);
  }
  void change(FieldStep& field) {
    field.generation = static_cast<std::uint32_t>(any());
    field.channel = static_cast<std::uint8_t>(any());
    field.swapping = one_in(2);
    for (double* value : {&field.depth, &field.stored, &field.refused, &field.credit}) change(*value);
    change(field.proxy);
    change(field.force);
  }
  void change_parts(StepRecord& step) {
    change(step.handle);
    change(step.field);
  }

  std::mt19937_64 random_;
  StepRecord last_{};
};

/// The messages of a recording contain all bits.
bool same(const StepRecord& a, const StepRecord& b) {
  return recording::encode(a) == recording::encode(b) && a.hand.at == b.hand.at && a.force_way == b.force_way;
}

TEST(StepFlight, KeepsEveryBitOfTheLastSteps) {
  for (const std::size_t capacity : {1U, 2U, 100U, 2048U}) {
    StepFlight flight(capacity);
    Steps random(capacity);
    std::vector<StepRecord> steps;
    for (int i = 0; i < 5000; ++i) {
      steps.push_back(random.next());
      flight.record(steps.back());
      flight.make_ready();
    }
    flight.freeze();
    flight.record(random.next());
    ASSERT_EQ(flight.size(), capacity);
    for (std::size_t i = 0; i < capacity; ++i) {
      ASSERT_TRUE(same(flight[i], steps[steps.size() - capacity + i])) << i << " of " << capacity;
    }
    flight.thaw();
    EXPECT_EQ(flight.size(), 0U);
    flight.record(steps.front());
    flight.record(steps.back());
    ASSERT_EQ(flight.size(), std::min<std::size_t>(capacity, 2));
    EXPECT_TRUE(same(flight[flight.size() - 1], steps.back())) << "after thaw";
  }
}

TEST(StepFlight, TheLargestStepsFitAsWell) {
  for (const bool rest : {false, true}) {
    StepFlight flight(2048, rest, rest);
    StepRecord step;
    std::mt19937_64 random(7);
    for (int i = 0; i < 6000; ++i) {
      for (double* value : {step.hand.position.data(), step.hand.velocity.data(), step.was_applied.data(),
                            step.wanted.data(), step.force.data(), step.applied.data()}) {
        for (int axis = 0; axis < 3; ++axis) value[axis] = std::bit_cast<double>(random());
      }
      for (double& value : step.stiffness.reshaped()) value = std::bit_cast<double>(random());
      step.hand_force = Vec3(std::bit_cast<double>(random()), std::bit_cast<double>(random()), 1e9 * i);
      for (double* value : {&step.permitted, &step.energy, &step.force_error.emplace()}) {
        *value = std::bit_cast<double>(random());
      }
      step.tick = random();
      step.force_sequence = random();
      for (Duration* value : {&step.held, &step.longest_hold, &step.force_age, &step.loop_age}) {
        *value = Duration(static_cast<Duration::rep>(random()));
      }
      step.channel = static_cast<std::uint32_t>(random());
      step.buttons = static_cast<std::uint32_t>(random());
      if (rest) {
        auto& handle = step.handle.emplace();
        handle.turn.emplace().wanted = step.wanted;
        handle.grip.emplace().energy = step.energy;
        for (double& angle : handle.joints.emplace().angle) angle = std::bit_cast<double>(random());
        step.field.emplace().proxy = step.force;
      }
      flight.record(step);
    }
    EXPECT_EQ(flight.size(), 2048U);
    EXPECT_TRUE(same(flight[2047], step));
  }
}

TEST(StepFlight, PartsThatAreNotKeptAreLeftOut) {
  StepFlight flight(4, false, false);
  StepRecord step;
  step.handle.emplace().grip.emplace();
  step.field.emplace();
  step.energy = 3;
  flight.record(step);
  EXPECT_FALSE(flight[0].handle);
  EXPECT_FALSE(flight[0].field);
  EXPECT_EQ(flight[0].energy, 3);
  EXPECT_TRUE(step.handle);
}

// The hand moves, and there is a new force in each step.
TEST(StepFlight, NeedsLessThanHalfOfTheMemoryOfTheSteps) {
  StepFlight flight(2048, false, false);
  StepRecord step;
  Dice dice(1);
  for (int i = 0; i < 10'000; ++i) {
    const double t = 1e-3 * i;
    ++step.tick;
    step.scheduled += Duration(1'000'000);
    const LocalTime before = step.hand.at;
    step.hand.at = step.scheduled + Duration(50'000 + static_cast<int>(10'000 * dice.within(-2, 2)));
    step.held = step.hand.at - before;
    step.hand.position = 0.015 * Vec3(std::sin(3 * t), std::sin(2 * t), std::cos(t));
    step.hand.velocity =
        0.045 * Vec3(std::cos(3 * t), std::cos(2 * t), std::sin(t)) + 1e-3 * Vec3::Constant(dice.within(-2, 2));
    step.was_applied = step.applied;
    step.wanted = step.force = step.applied = -300 * step.hand.position;
    step.permitted = 1 + std::abs(dice.within(-2, 2));
    step.energy = 1e-3 * step.permitted;
    ++step.force_sequence;
    step.force_age = Duration(200'000 + static_cast<int>(10'000 * dice.within(-2, 2)));
    step.loop_age = step.force_age + Duration(500'000);
    flight.record(step);
  }
  EXPECT_LT(flight.used_bytes(), 2048 * 130);
  EXPECT_GT(flight.used_bytes(), 2048 * 50) << "these are no steps";
}

TEST(StepFlight, RefusesToKeepNothing) {
  EXPECT_THROW(StepFlight(0), std::invalid_argument);
  EXPECT_THROW(StepFlight(65537), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::step_flight_test
