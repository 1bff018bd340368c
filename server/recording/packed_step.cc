// SPDX-License-Identifier: Apache-2.0
#include "server/recording/packed_step.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace tendon {
namespace {

// The format of a section: a mask of the stored values, then the size of each value (one byte, or two bytes for a
// vector) and its significant bytes. The sections are step, turn, grip, joints and field.
constexpr std::size_t kMask = sizeof(std::uint32_t);
constexpr std::size_t kMostOfNumber = 1 + 8;
constexpr std::size_t kMostOfVector = 2 + 3 * 8;

enum Has : std::uint32_t {
  kHandForce = 1U << 0,
  kForceError = 1U << 1,
  kRearmed = 1U << 2,
  kIsDisarmed = 1U << 3,
  kHandle = 1U << 4,
  kTurn = 1U << 5,
  kGrip = 1U << 6,
  kJoints = 1U << 7,
  kField = 1U << 8,
};

std::uint32_t packed_parts(const StepRecord& step) noexcept {
  std::uint32_t parts = 0;
  if (step.hand_force) parts |= kHandForce;
  if (step.force_error) parts |= kForceError;
  if (step.rearmed) parts |= kRearmed;
  if (step.disarmed) parts |= kIsDisarmed;
  if (step.field) parts |= kField;
  if (!step.handle) return parts;
  parts |= kHandle;
  if (step.handle->turn) parts |= kTurn;
  if (step.handle->grip) parts |= kGrip;
  if (step.handle->joints) parts |= kJoints;
  return parts;
}

std::uint64_t bits(double value) noexcept { return std::bit_cast<std::uint64_t>(value); }
std::uint64_t number(std::uint64_t value) noexcept { return value; }
std::uint64_t number(Duration value) noexcept { return static_cast<std::uint64_t>(value.count()); }
std::uint64_t number(LocalTime value) noexcept { return number(value.time_since_epoch()); }
void set(std::uint64_t& value, std::uint64_t to) noexcept { value = to; }
void set(std::uint32_t& value, std::uint64_t to) noexcept { value = static_cast<std::uint32_t>(to); }
void set(Duration& value, std::uint64_t to) noexcept { value = Duration(static_cast<Duration::rep>(to)); }
void set(LocalTime& value, std::uint64_t to) noexcept { value = LocalTime(Duration(static_cast<Duration::rep>(to))); }

class Packer {
 public:
  explicit Packer(std::byte* to) noexcept : section_(to), to_(to + kMask) {}

  template <class Whole>
  void whole(const Whole& value, const Whole& predicted) noexcept {
    const std::uint64_t apart = number(value) - number(predicted);
    one((apart << 1U) ^ (0 - (apart >> 63U)));  // small for small negative differences
  }
  void real(const double& value, double predicted) noexcept { one(bits(value) ^ bits(predicted)); }
  void vector(const Vec3& value, const Vec3& predicted) noexcept {
    const std::uint64_t x = bits(value[0]) ^ bits(predicted[0]);
    const std::uint64_t y = bits(value[1]) ^ bits(predicted[1]);
    const std::uint64_t z = bits(value[2]) ^ bits(predicted[2]);
    if ((x | y | z) != 0) {
      mask_ |= bit_;
      std::byte* const sizes = to_;
      to_ += 2;
      const std::size_t of_x = put(x);
      const std::size_t of_y = put(y);
      const std::size_t of_z = put(z);
      const auto packed = static_cast<std::uint16_t>(of_x | of_y << 4U | of_z << 8U);
      std::memcpy(sizes, &packed, sizeof packed);
    }
    bit_ <<= 1U;
  }
  void next_section() noexcept {
    std::memcpy(section_, &mask_, kMask);
    section_ = to_;
    to_ += kMask;
    mask_ = 0;
    bit_ = 1;
  }
  std::byte* end() noexcept {
    std::memcpy(section_, &mask_, kMask);
    return to_;
  }

 private:
  void one(std::uint64_t word) noexcept {
    if (word != 0) {
      mask_ |= bit_;
      std::byte* const size = to_++;
      *size = static_cast<std::byte>(put(word));
    }
    bit_ <<= 1U;
  }
  std::size_t put(std::uint64_t word) noexcept {
    const auto size = static_cast<std::size_t>(std::bit_width(word) + 7) / 8;
    std::memcpy(to_, &word, sizeof word);
    to_ += size;
    return size;
  }

  std::byte* section_;
  std::byte* to_;
  std::uint32_t mask_ = 0;
  std::uint32_t bit_ = 1;
};

class Unpacker {
 public:
  explicit Unpacker(const std::byte* from) noexcept : from_(from) { begin_section(); }

  template <class Whole>
  void whole(Whole& value, const Whole& predicted) noexcept {
    const std::uint64_t folded = one();
    set(value, number(predicted) + ((folded >> 1U) ^ (0 - (folded & 1U))));
  }
  void real(double& value, double predicted) noexcept { value = std::bit_cast<double>(one() ^ bits(predicted)); }
  void vector(Vec3& value, const Vec3& predicted) noexcept {
    Vec3 result = predicted;
    if (take()) {
      std::uint16_t sizes = 0;
      std::memcpy(&sizes, from_, sizeof sizes);
      from_ += sizeof sizes;
      for (int axis = 0; axis < 3; ++axis) {
        result[axis] = std::bit_cast<double>(bits(predicted[axis]) ^ get(sizes >> (4 * axis) & 15U));
      }
    }
    value = result;
  }
  void next_section() noexcept { begin_section(); }
  const std::byte* end() const noexcept { return from_; }

 private:
  void begin_section() noexcept {
    std::memcpy(&mask_, from_, kMask);
    from_ += kMask;
  }
  bool take() noexcept {
    const bool there = (mask_ & 1U) != 0;
    mask_ >>= 1U;
    return there;
  }
  std::uint64_t one() noexcept {
    if (!take()) return 0;
    const auto size = static_cast<std::size_t>(*from_++);
    return get(size);
  }
  std::uint64_t get(std::size_t size) noexcept {
    std::uint64_t word = 0;
    std::memcpy(&word, from_, size);
    from_ += size;
    return word;
  }

  const std::byte* from_;
  std::uint32_t mask_ = 0;
};

template <class Turn, class Coder>
void code_turn(Turn& turn, const TurnStep* before, Coder& coder) noexcept {
  constexpr Quat kNone{.w = 0};
  const Quat& last = before != nullptr ? before->hand.orientation : kNone;
  coder.next_section();
  auto& q = turn.hand.orientation;
  coder.real(q.w, last.w);
  coder.real(q.x, last.x);
  coder.real(q.y, last.y);
  coder.real(q.z, last.z);
  coder.vector(turn.hand.angular_velocity, before != nullptr ? before->hand.angular_velocity : Vec3(Vec3::Zero()));
  coder.vector(turn.was_applied, before != nullptr ? before->applied : Vec3(Vec3::Zero()));
  coder.vector(turn.wanted, before != nullptr ? before->wanted : Vec3(Vec3::Zero()));
  coder.vector(turn.torque, turn.wanted);
  coder.vector(turn.applied, turn.torque);
}

template <class GripOf, class Coder>
void code_grip(GripOf& grip, const GripStep& before, Coder& coder) noexcept {
  coder.next_section();
  coder.real(grip.hand.opening, before.hand.opening);
  coder.real(grip.hand.velocity, before.hand.velocity);
  coder.real(grip.was_applied, before.applied);
  coder.real(grip.wanted, before.wanted);
  coder.real(grip.force, grip.wanted);
  coder.real(grip.applied, grip.force);
  coder.real(grip.permitted, before.permitted);
  coder.real(grip.energy, before.energy);
}

template <class JointsOf, class Coder>
void code_joints(JointsOf& joints, const Joints& before, Coder& coder) noexcept {
  coder.next_section();
  coder.whole(joints.count, before.count);
  for (std::size_t i = 0; i < Joints::kMost; ++i) {
    coder.real(joints.angle[i], before.angle[i]);
    coder.real(joints.velocity[i], before.velocity[i]);
  }
}

template <class Field, class Coder>
void code_field(Field& field, const FieldStep& before, Coder& coder) noexcept {
  coder.next_section();
  coder.whole(field.generation, before.generation);
  auto place = static_cast<std::uint32_t>(field.channel | (field.swapping ? 256U : 0U));
  coder.whole(place, static_cast<std::uint32_t>(before.channel | (before.swapping ? 256U : 0U)));
  if constexpr (!std::is_const_v<Field>) {
    field.channel = static_cast<std::uint8_t>(place);
    field.swapping = (place & 256U) != 0;
  }
  coder.real(field.depth, before.depth);
  coder.vector(field.proxy, before.proxy);
  coder.vector(field.force, before.force);
  coder.real(field.stored, before.stored);
  coder.real(field.refused, before.refused);
  coder.real(field.credit, before.credit);
}

/// Codes the optional parts, which must exist in `step`.
template <class Record, class Coder>
void code_packed_parts(Record& step, const StepRecord& last, std::uint32_t parts, Coder& coder) noexcept {
  if ((parts & kHandle) != 0) {
    const HandleStep* const before = last.handle ? &*last.handle : nullptr;
    auto& handle = *step.handle;
    if ((parts & kTurn) != 0)
      code_turn(*handle.turn, before != nullptr && before->turn ? &*before->turn : nullptr, coder);
    if ((parts & kGrip) != 0)
      code_grip(*handle.grip, before != nullptr && before->grip ? *before->grip : GripStep{}, coder);
    if ((parts & kJoints) != 0) {
      code_joints(*handle.joints, before != nullptr && before->joints ? *before->joints : Joints{}, coder);
    }
  }
  if ((parts & kField) != 0) code_field(*step.field, last.field ? *last.field : FieldStep{}, coder);
}

void make_packed_parts(StepRecord& step, std::uint32_t parts) noexcept {
  const auto make = [parts](auto& part, std::uint32_t which) {
    part.reset();
    if ((parts & which) != 0) part.emplace();
  };
  make(step.hand_force, kHandForce);
  make(step.force_error, kForceError);
  make(step.field, kField);
  make(step.handle, kHandle);
  step.rearmed = (parts & kRearmed) != 0;
  step.disarmed = (parts & kIsDisarmed) != 0;
  if (!step.handle) return;
  make(step.handle->turn, kTurn);
  make(step.handle->grip, kGrip);
  make(step.handle->joints, kJoints);
}

/// The order of the values, for both directions: a prediction only uses values that were coded before.
template <class Record, class Coder>
void code(Record& step, const StepBefore& before, Coder& coder) noexcept {
  constexpr bool kUnpacks = !std::is_const_v<Record>;
  const StepRecord& last = before.step;
  std::uint32_t parts = 0;
  if constexpr (!kUnpacks) parts = packed_parts(step);
  coder.whole(parts, packed_parts(last));
  if constexpr (kUnpacks) make_packed_parts(step, parts);

  coder.whole(step.tick, last.tick + 1);
  coder.whole(step.scheduled, last.scheduled + before.spacing);
  coder.whole(step.hand.at, step.scheduled);
  coder.whole(step.held, step.hand.at - last.hand.at);
  coder.vector(step.hand.position, last.hand.position);
  coder.vector(step.hand.velocity, last.hand.velocity);
  coder.vector(step.was_applied, last.applied);
  if ((parts & kHandForce) != 0) {
    coder.vector(*step.hand_force, last.hand_force ? *last.hand_force : Vec3(Vec3::Zero()));
  }
  coder.vector(step.wanted, last.wanted);
  coder.vector(step.force, step.wanted);
  coder.vector(step.applied, step.force);
  for (int column = 0; column < 3; ++column) {
    Vec3 stiffness = step.stiffness.col(column);
    coder.vector(stiffness, last.stiffness.col(column));
    if constexpr (kUnpacks) step.stiffness.col(column) = stiffness;
  }
  coder.real(step.permitted, last.permitted);
  coder.real(step.energy, last.energy);
  coder.whole(step.longest_hold, last.longest_hold);
  std::uint64_t labels = 0;
  const auto labels_of = [](const StepRecord& of) {
    return std::uint64_t{of.reasons.bits()} << 16U | std::uint64_t{of.force_way} << 8U |
           static_cast<std::uint64_t>(of.mode);
  };
  if constexpr (!kUnpacks) labels = labels_of(step);
  coder.whole(labels, labels_of(last));
  if constexpr (kUnpacks) {
    step.mode = static_cast<Mode>(labels & 255U);
    step.force_way = static_cast<std::uint8_t>(labels >> 8U);
    step.reasons = Reasons::from_bits(static_cast<std::uint32_t>(labels >> 16U));
  }
  coder.whole(step.channel, last.channel);
  coder.whole(step.buttons, last.buttons);
  coder.whole(step.force_sequence, last.force_sequence);
  coder.whole(step.force_age, last.force_age);
  coder.whole(step.loop_age, last.loop_age);
  if ((parts & kForceError) != 0) coder.real(*step.force_error, last.force_error.value_or(0));
  code_packed_parts(step, last, parts, coder);
}

}  // namespace

std::size_t most_packed_bytes(bool handles, bool fields) noexcept {
  std::size_t most = kMask + 15 * kMostOfNumber + 10 * kMostOfVector;
  if (handles) most += 3 * kMask + (4 + 8 + 1 + 2 * Joints::kMost) * kMostOfNumber + 5 * kMostOfVector;
  if (fields) most += kMask + 6 * kMostOfNumber + 2 * kMostOfVector;
  return most;
}

std::byte* pack_step(const StepRecord& step, const StepBefore& before, std::byte* to) noexcept {
  Packer packer(to);
  code(step, before, packer);
  return packer.end();
}

const std::byte* unpack_step(const std::byte* from, const StepBefore& before, StepRecord& step) noexcept {
  Unpacker unpacker(from);
  code(step, before, unpacker);
  return unpacker.end();
}

}  // namespace tendon
