// SPDX-License-Identifier: Apache-2.0
#include "server/clients/field_slots.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <memory>
#include <optional>
#include <thread>

#include "tests/support/dice.h"

namespace tendon::field_slots_test {
namespace {

constexpr std::uint32_t kEngine = 7;

FieldName name_of(std::uint8_t number) { return {static_cast<std::byte>(number)}; }

/// A channel, and the haptic thread that takes its fields.
class Slots : public ::testing::Test {
 protected:
  /// The stiffness is the generation. The distance at the origin is the number of the shape.
  void use(std::uint32_t generation, std::uint8_t shape, std::uint32_t source = kEngine) {
    const auto fill = [&](field::BrickField& bricks) {
      ++fills_;
      bricks.reset({.spacing = 1e-3, .scale = 1e-5, .bricks = {1, 1, 1}});
      field::BrickField::Weights weights;
      weights.fill(shape);
      bricks.put({0, 0, 0}, weights);
      bricks.finish();
    };
    slots_.use({.materials = {{.stiffness = static_cast<double>(generation)}}}, name_of(shape), fill, generation,
               source);
    shape_of_[generation % 64] = shape;
  }
  void take() {
    const PostedField* const posted = box_->use.take();
    if (posted == nullptr) return;
    const bool stops = posted->use.field == nullptr;
    if (!stops || (used_ && used_->source == posted->use.source)) used_ = posted->use;  // as HeldForce
    box_->taken.store(posted->number);
  }
  void expect_unchanged() const {
    if (!used_ || used_->field == nullptr) return;
    ASSERT_EQ(used_->field->materials.front().stiffness, used_->generation);
    ASSERT_NEAR(used_->field->bricks->at(Vec3::Constant(4e-3)).distance, 1e-5 * shape_of_[used_->generation % 64],
                1e-12);
  }

  std::unique_ptr<FieldBox> box_ = std::make_unique<FieldBox>();
  FieldSlots slots_{*box_};
  std::optional<FieldUse> used_;
  int fills_ = 0;
  std::array<std::uint8_t, 64> shape_of_{};
};

TEST_F(Slots, AFieldInUseDoesNotChange) {
  Dice dice(1);
  std::uint32_t engine = 1;
  std::uint32_t generation = 0;
  std::uint32_t taken = 0;
  for (int i = 0; i < 3000; ++i) {
    if (dice.chance(0.02)) engine = static_cast<std::uint32_t>(1 + dice.bits() % 2);
    if (dice.chance(0.5)) use(++generation, static_cast<std::uint8_t>(1 + dice.bits() % 5), engine);
    if (dice.chance(0.05)) slots_.stop();
    if (dice.chance(0.5)) slots_.turn(engine);
    expect_unchanged();
    if (dice.chance(0.5)) take();
    expect_unchanged();
    if (used_) taken = std::max(taken, used_->generation);
  }
  EXPECT_GT(taken, 1000U);
}

TEST_F(Slots, TheNewestOfSeveralFieldsIsPosted) {
  use(1, 1);
  slots_.turn(kEngine);
  for (std::uint32_t generation = 2; generation < 6; ++generation) {
    use(generation, 2);
    slots_.turn(kEngine);
  }
  take();
  EXPECT_EQ(used_->generation, 1U);
  slots_.turn(kEngine);
  take();
  EXPECT_EQ(used_->generation, 5U);
}

TEST_F(Slots, BricksInASlotAreNotBuiltAgain) {
  for (std::uint32_t generation = 1; generation <= 20; ++generation) {
    EXPECT_EQ(slots_.has(name_of(generation % 2)), generation > 2);
    use(generation, generation % 2);
    slots_.turn(kEngine);
    take();
  }
  EXPECT_EQ(fills_, 2);
}

TEST_F(Slots, AFieldOfAFormerHolderIsDropped) {
  use(1, 1);
  slots_.turn(kEngine + 1);
  take();
  EXPECT_FALSE(used_);
  use(1, 1, kEngine + 1);
  slots_.turn(kEngine + 1);
  take();
  ASSERT_TRUE(used_);
  EXPECT_EQ(used_->source, kEngine + 1);
}

TEST_F(Slots, AFieldWhoseSourceHasLeftIsStopped) {
  use(1, 1);
  slots_.turn(kEngine);
  slots_.turn(0);
  take();
  EXPECT_NE(used_->field, nullptr);
  for (int i = 0; i < 3; ++i) {
    slots_.turn(0);
    take();
    EXPECT_EQ(used_->field, nullptr);
    EXPECT_EQ(used_->source, kEngine);
  }
  EXPECT_EQ(box_->taken, 2U) << "once";
}

// Under the thread sanitizer, this also finds a slot that is filled too early.
TEST_F(Slots, AFieldDoesNotChangeWhileAnotherThreadUsesIt) {
  std::atomic<bool> done{false};
  std::uint64_t changed = 0;
  std::uint32_t newest = 0;
  std::thread haptic([&] {
    while (!done) {
      take();
      if (!used_ || used_->field == nullptr) continue;
      newest = std::max(newest, used_->generation);
      const double stiffness = used_->field->materials.front().stiffness;
      const double distance = used_->field->bricks->at(Vec3::Constant(4e-3)).distance;
      if (stiffness != used_->generation || std::abs(distance - 1e-5 * (1 + used_->generation % 5)) > 1e-12) ++changed;
    }
  });
  for (std::uint32_t generation = 1; generation <= 5000; ++generation) {
    use(generation, static_cast<std::uint8_t>(1 + generation % 5), 1 + generation / 100 % 2);
    if (generation % 7 == 0) slots_.stop();
    slots_.turn(1 + generation / 100 % 2);
  }
  done = true;
  haptic.join();
  EXPECT_EQ(changed, 0U);
  EXPECT_GT(newest, 0U);
}

}  // namespace
}  // namespace tendon::field_slots_test
