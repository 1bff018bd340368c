// SPDX-License-Identifier: Apache-2.0
#include "server/clients/field_slots.h"

#include <algorithm>
#include <atomic>
#include <utility>

namespace tendon {

FieldSlots::Slot& FieldSlots::prepare() {
  if (box_.taken.load(std::memory_order_acquire) == number_) used_ = posted_;
  Slot& slot = *std::ranges::find_if(slots_, [this](const Slot& one) { return &one != used_ && &one != posted_; });
  waiting_ = &slot;
  return slot;
}

bool FieldSlots::has(const FieldName& bricks) const noexcept {
  return std::ranges::any_of(shapes_, [&](const Shape& one) { return one.name == bricks; });
}

FieldSlots::Shape& FieldSlots::shape_for(const FieldName& name, const Fill& fill) {
  const auto known = std::ranges::find(shapes_, name, &Shape::name);
  if (known != shapes_.end()) return *known;
  const auto is_free = [this](const Shape& one) {
    return !(used_ != nullptr && used_->shape == &one) && !(posted_ != nullptr && posted_->shape == &one);
  };
  Shape& shape = *std::ranges::find_if(shapes_, is_free);
  shape.name.reset();
  fill(shape.bricks);
  shape.name = name;
  return shape;
}

void FieldSlots::use(field::Field field, const std::optional<FieldName>& bricks, const Fill& fill,
                     std::uint32_t generation, std::uint32_t source) {
  Slot& slot = prepare();
  slot.shape = bricks ? &shape_for(*bricks, fill) : nullptr;
  slot.field = std::move(field);
  slot.field.bricks = slot.shape != nullptr ? &slot.shape->bricks : nullptr;
  slot.use = {.field = &slot.field, .generation = generation, .source = source};
}

void FieldSlots::stop() {
  waiting_ = nullptr;
  if (posted_ == nullptr || posted_->use.field == nullptr) return;
  Slot& slot = prepare();
  slot.shape = nullptr;
  slot.use = {.field = nullptr, .generation = 0, .source = posted_->use.source};
}

void FieldSlots::move(const ArrivedPose& pose) {
  pose_ = pose;
  box_.pose.put(pose);
}

void FieldSlots::turn(std::uint32_t holder) {
  if (box_.taken.load(std::memory_order_acquire) != number_) return;
  if (waiting_ != nullptr && waiting_->use.source != holder) waiting_ = nullptr;
  if (waiting_ == nullptr && posted_ != nullptr && posted_->use.field != nullptr && posted_->use.source != holder) {
    stop();
  }
  if (waiting_ == nullptr) return;
  const Slot& next = *std::exchange(waiting_, nullptr);
  used_ = std::exchange(posted_, &next);
  box_.use.put({.use = next.use, .number = ++number_});
  if (pose_ && pose_->source == holder) box_.pose.put(*pose_);
}

}  // namespace tendon
