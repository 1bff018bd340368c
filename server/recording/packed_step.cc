// SPDX-License-Identifier: Apache-2.0
#include "server/recording/packed_step.h"

#include <array>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace tendon {
namespace {

// The sections are step, turn, grip, joints and field. Each starts with a mask. The prediction was wrong for the values
// that follow. Whole numbers take 4 or 8 bytes and two bits of the mask. Real numbers take 8 bytes.
constexpr std::size_t kMask = sizeof(std::uint64_t);
constexpr std::size_t kNumber = 8;
constexpr std::size_t kVector = 3 * 8;
constexpr std::size_t kMatrix = 3 * kVector;

enum Has : std::uint16_t {
  kHandForce = 1U << 0,
  kForceError = 1U << 1,
  kRearmed = 1U << 2,
  kIsDisarmed = 1U << 3,
  kStiffness = 1U << 4,
  kHandle = 1U << 5,
  kTurn = 1U << 6,
  kGrip = 1U << 7,
  kJoints = 1U << 8,
  kField = 1U << 9,
};
constexpr unsigned kParts = 10;  ///< number of bits of the first mask

template <std::size_t count>
using Words = std::array<std::uint64_t, count>;

/// The bits of the numbers, because NaN is not equal to itself and −0 is equal to 0.
template <class Numbers>
auto words(const Numbers& numbers) noexcept {
  Words<sizeof numbers / kNumber> result;
  std::memcpy(result.data(), &numbers, sizeof numbers);
  return result;
}

template <std::size_t count>
bool same(const Words<count>& a, const Words<count>& b) noexcept {
  std::uint64_t apart = 0;
  for (std::size_t i = 0; i < count; ++i) apart |= a[i] ^ b[i];
  return apart == 0;
}

std::uint16_t packed_parts(const StepRecord& step) noexcept {
  unsigned parts = 0;
  if (step.hand_force) parts |= kHandForce;
  if (step.force_error) parts |= kForceError;
  if (step.rearmed) parts |= kRearmed;
  if (step.disarmed) parts |= kIsDisarmed;
  if (!same(words(step.stiffness), {})) parts |= kStiffness;
  if (step.field) parts |= kField;
  if (step.handle) {
    parts |= kHandle;
    if (step.handle->turn) parts |= kTurn;
    if (step.handle->grip) parts |= kGrip;
    if (step.handle->joints) parts |= kJoints;
  }
  return static_cast<std::uint16_t>(parts);
}

/// Creates the optional parts with zero values.
void make_packed_parts(StepRecord& step, unsigned parts) noexcept {
  step = {};
  if ((parts & kHandForce) != 0) step.hand_force.emplace();
  if ((parts & kForceError) != 0) step.force_error.emplace();
  step.rearmed = (parts & kRearmed) != 0;
  step.disarmed = (parts & kIsDisarmed) != 0;
  if ((parts & kField) != 0) step.field.emplace();
  if ((parts & kHandle) == 0) return;
  HandleStep& handle = step.handle.emplace();
  if ((parts & kTurn) != 0) handle.turn.emplace();
  if ((parts & kGrip) != 0) handle.grip.emplace();
  if ((parts & kJoints) != 0) handle.joints.emplace();
}

std::uint64_t number(std::uint64_t value) noexcept { return value; }
std::uint64_t number(Duration value) noexcept { return static_cast<std::uint64_t>(value.count()); }
std::uint64_t number(LocalTime value) noexcept { return number(value.time_since_epoch()); }
void set(std::uint64_t& value, std::uint64_t to) noexcept { value = to; }
void set(std::uint32_t& value, std::uint64_t to) noexcept { value = static_cast<std::uint32_t>(to); }
void set(Duration& value, std::uint64_t to) noexcept { value = Duration(static_cast<Duration::rep>(to)); }
void set(LocalTime& value, std::uint64_t to) noexcept { value = LocalTime(Duration(static_cast<Duration::rep>(to))); }

class Packer {
 public:
  Packer(std::byte* to, unsigned parts) noexcept : section_(to), to_(to + kMask), mask_(parts) {}

  template <class Whole>
  void whole(const Whole& value, const Whole& predicted = {}) noexcept {
    const std::uint64_t apart = number(value) - number(predicted);
    if (apart != 0) {
      const bool small = static_cast<std::uint64_t>(static_cast<std::int32_t>(apart)) == apart;
      mask_ |= small ? bit_ : bit_ << 1U;
      std::memcpy(to_, &apart, sizeof apart);
      to_ += small ? 4 : 8;
    }
    bit_ <<= 2U;
  }
  /// One or several real numbers.
  template <class Real>
  void real(const Real& value, const Real& predicted) noexcept {
    if (!same(words(value), words(predicted))) {
      mask_ |= bit_;
      std::memcpy(to_, &value, sizeof value);
      to_ += sizeof value;
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
  std::byte* section_;
  std::byte* to_;
  std::uint64_t mask_;
  std::uint64_t bit_ = 1U << kParts;
};

class Unpacker {
 public:
  explicit Unpacker(const std::byte* from) noexcept : from_(from) {
    next_section();
    parts_ = static_cast<unsigned>(mask_ & ((1U << kParts) - 1));
    mask_ >>= kParts;
  }
  unsigned parts() const noexcept { return parts_; }

  template <class Whole>
  void whole(Whole& value, const Whole& predicted = {}) noexcept {
    std::int32_t small = 0;
    std::uint64_t apart = 0;
    if (read(small)) apart = static_cast<std::uint64_t>(std::int64_t{small});
    read(apart);
    set(value, number(predicted) + apart);
  }
  template <class Real>
  void real(Real& value, const Real& predicted) noexcept {
    if (!read(value)) value = predicted;
  }
  void next_section() noexcept {
    std::memcpy(&mask_, from_, kMask);
    from_ += kMask;
  }
  const std::byte* end() const noexcept { return from_; }

 private:
  template <class Value>
  bool read(Value& value) noexcept {
    const bool stored = (mask_ & 1U) != 0;
    mask_ >>= 1U;
    if (!stored) return false;
    std::memcpy(static_cast<void*>(&value), from_, sizeof value);
    from_ += sizeof value;
    return true;
  }

  const std::byte* from_;
  std::uint64_t mask_ = 0;
  unsigned parts_ = 0;
};

const Vec3 kNoVector = Vec3::Zero();

template <class Turn, class Coder>
void code_turn(Turn& turn, Coder& coder) noexcept {
  coder.next_section();
  auto& q = turn.hand.orientation;
  for (auto* part : {&q.w, &q.x, &q.y, &q.z}) coder.real(*part, 0.0);
  coder.real(turn.hand.angular_velocity, kNoVector);
  coder.real(turn.was_applied, kNoVector);
  coder.real(turn.wanted, kNoVector);
  coder.real(turn.torque, turn.wanted);
  coder.real(turn.applied, turn.torque);
}

template <class GripOf, class Coder>
void code_grip(GripOf& grip, Coder& coder) noexcept {
  coder.next_section();
  coder.real(grip.hand.opening, 0.0);
  coder.real(grip.hand.velocity, 0.0);
  coder.real(grip.was_applied, 0.0);
  coder.real(grip.wanted, 0.0);
  coder.real(grip.force, grip.wanted);
  coder.real(grip.applied, grip.force);
  coder.real(grip.permitted, 0.0);
  coder.real(grip.energy, 0.0);
}

template <class JointsOf, class Coder>
void code_joints(JointsOf& joints, Coder& coder) noexcept {
  coder.next_section();
  coder.whole(joints.count);
  for (auto& angle : joints.angle) coder.real(angle, 0.0);
  for (auto& velocity : joints.velocity) coder.real(velocity, 0.0);
}

template <class Field, class Coder>
void code_field(Field& field, Coder& coder) noexcept {
  coder.next_section();
  coder.whole(field.generation);
  auto place = static_cast<std::uint32_t>(field.channel | (field.swapping ? 256U : 0U));
  coder.whole(place);
  if constexpr (!std::is_const_v<Field>) {
    field.channel = static_cast<std::uint8_t>(place);
    field.swapping = (place & 256U) != 0;
  }
  coder.real(field.depth, 0.0);
  coder.real(field.proxy, kNoVector);
  coder.real(field.force, kNoVector);
  coder.real(field.stored, 0.0);
  coder.real(field.refused, 0.0);
  coder.real(field.credit, 0.0);
}

/// The order of the values, for both directions. The optional parts must exist.
template <class Record, class Coder>
void code(Record& step, unsigned parts, StepBefore& before, Coder& coder) noexcept {
  constexpr bool kUnpacks = !std::is_const_v<Record>;
  coder.whole(step.tick, before.tick + 1);
  coder.whole(step.scheduled, before.scheduled + before.spacing);
  coder.whole(step.hand.at, step.scheduled);
  coder.whole(step.held, step.hand.at - before.at);
  coder.real(step.hand.position, kNoVector);
  coder.real(step.hand.velocity, kNoVector);
  coder.real(step.was_applied, before.applied);
  coder.real(step.wanted, kNoVector);
  coder.real(step.force, step.wanted);
  coder.real(step.applied, step.force);
  coder.real(step.permitted, 0.0);
  coder.real(step.energy, 0.0);
  coder.whole(step.longest_hold, before.longest_hold);
  std::uint64_t labels = 0;
  if constexpr (!kUnpacks) {
    labels = std::uint64_t{step.reasons.bits()} << 16U | std::uint64_t{step.force_way} << 8U |
             static_cast<std::uint64_t>(step.mode);
  }
  coder.whole(labels, before.labels);
  if constexpr (kUnpacks) {
    step.mode = static_cast<Mode>(labels & 255U);
    step.force_way = static_cast<std::uint8_t>(labels >> 8U);
    step.reasons = Reasons::from_bits(static_cast<std::uint32_t>(labels >> 16U));
  }
  coder.whole(step.channel);
  coder.whole(step.buttons);
  coder.whole(step.force_sequence);
  coder.whole(step.force_age);
  coder.whole(step.loop_age);

  before.spacing = step.scheduled - before.scheduled;
  before.tick = step.tick;
  before.scheduled = step.scheduled;
  before.at = step.hand.at;
  before.applied = step.applied;
  before.longest_hold = step.longest_hold;
  before.labels = labels;

  if ((parts & kStiffness) != 0) {
    coder.real(step.stiffness, before.stiffness);
    before.stiffness = step.stiffness;
  }
  if ((parts & kHandForce) != 0) coder.real(*step.hand_force, kNoVector);
  if ((parts & kForceError) != 0) coder.real(*step.force_error, 0.0);
  if ((parts & kTurn) != 0) code_turn(*step.handle->turn, coder);
  if ((parts & kGrip) != 0) code_grip(*step.handle->grip, coder);
  if ((parts & kJoints) != 0) code_joints(*step.handle->joints, coder);
  if ((parts & kField) != 0) code_field(*step.field, coder);
}

}  // namespace

std::size_t most_packed_bytes(bool handles, bool fields) noexcept {
  std::size_t most = kMask + 14 * kNumber + 7 * kVector + kMatrix;
  if (handles) most += 3 * kMask + (4 + 8 + 1 + 2 * Joints::kMost) * kNumber + 5 * kVector;
  if (fields) most += kMask + 6 * kNumber + 2 * kVector;
  return most;
}

std::byte* pack_step(const StepRecord& step, StepBefore& before, std::byte* to) noexcept {
  const unsigned parts = packed_parts(step);
  Packer packer(to, parts);
  code(step, parts, before, packer);
  return packer.end();
}

const std::byte* unpack_step(const std::byte* from, StepBefore& before, StepRecord& step) noexcept {
  Unpacker unpacker(from);
  make_packed_parts(step, unpacker.parts());
  code(step, unpacker.parts(), before, unpacker);
  return unpacker.end();
}

}  // namespace tendon
