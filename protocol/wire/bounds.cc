// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/bounds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "core/base/rotation.h"
#include "core/field/field.h"
#include "protocol/limits.h"
#include "protocol/link.h"
#include "protocol/wire/fields/reader.h"
#include "protocol/wire/fields/writer.h"
#include "protocol/wire/generated/frame_fields.h"
#include "protocol/wire/generated/request_fields.h"

namespace tendon {
namespace {

bool all_bounded(const auto& numbers) noexcept { return (numbers.array().abs() <= limits::kMaxValue).all(); }

using wire::Name;
using wire::Within;

/// A visitor of lists (fields/field.h) that checks all fields of floating-point numbers, and no others.
class Numbers {
 public:
  bool in_bounds = true;
  bool finite = true;

  void number(auto /*field*/, Name /*name*/, double value, const Within& bound = {}) noexcept { check(value, bound); }
  void maybe(auto /*field*/, Name /*name*/, const auto& value, const auto&... bound) noexcept {
    if (value) check(*value, bound...);
  }
  void radius(auto /*field*/, Name /*name*/, double value) noexcept { check(value, {.least = 0, .infinity = true}); }
  void vector(auto /*field*/, Name /*name*/, const Vec3& value) noexcept { check(value); }
  void normal(auto /*field*/, Name /*name*/, const Vec3& value) noexcept {
    check(value);
    in_bounds &= wire::is_unit(value);
  }
  void rotation(auto /*field*/, Name /*name*/, const Quat& value) noexcept { check(value); }
  void matrix(auto /*field*/, Name /*name*/, const Mat3& value) noexcept { check(value); }
  void numbers(auto /*field*/, Name /*name*/, const auto& value, std::size_t size, std::size_t least = 0,
               const Within& bound = {}) noexcept {
    in_bounds &= size >= least && size <= value.size();
    for (std::size_t i = 0; i < std::min(size, value.size()); ++i) check(value[i], bound);
  }
  template <class Value>
  void message(auto /*field*/, Name /*name*/, const std::optional<Value>& value, auto list) noexcept {
    if (value) list(*this, *value);
  }
  void part(auto /*field*/, const auto& value, auto fields) noexcept {
    if (value) fields(*value);
  }
  void count(const auto&... /*unused*/) noexcept {}
  void flag(const auto&... /*unused*/) noexcept {}
  void choice(const auto&... /*unused*/) noexcept {}
  void period(const auto&... /*unused*/) noexcept {}
  void duration(const auto&... /*unused*/) noexcept {}
  void text(const auto&... /*unused*/) noexcept {}

 private:
  void check(double value, const Within& bound = {}) noexcept {
    in_bounds &= bound.holds(value);
    finite &= std::isfinite(value) || (bound.infinity && !std::isnan(value));
  }
  void check(const Quat& value) noexcept {
    in_bounds &= is_rotation(value);
    finite &= Eigen::Vector4d(value.w, value.x, value.y, value.z).allFinite();
  }
  void check(const auto& matrix) noexcept {
    in_bounds &= all_bounded(matrix);
    finite &= matrix.allFinite();
  }
};

Numbers numbers_of(const ForceCommand& command) noexcept {
  Numbers numbers;
  wire::kForceCommandFields(numbers, command);
  return numbers;
}

/// Encodes a request and returns the name of a field that would be refused.
template <std::size_t kMost = 128, class Wanted, class List>
std::string_view refused(Wanted& wanted, List list) {
  wanted.device = 0;
  std::array<wire::Byte, kMost> bytes;
  wire::Writer out(bytes.data());
  list(out, wanted);
  wire::Reader in(bytes.data(), out.at());
  Wanted received;
  list(in, received);
  return in.refused() == nullptr ? std::string_view() : in.refused();
}

}  // namespace

bool in_bounds(const ForceCommand& command) noexcept { return numbers_of(command).in_bounds; }
bool is_finite(const ForceCommand& command) noexcept { return numbers_of(command).finite; }

std::string_view refused_field(SetOutput wanted) noexcept { return refused(wanted, wire::kSetOutputFields); }
std::string_view refused_field(SetScale wanted) noexcept { return refused(wanted, wire::kSetScaleFields); }
std::string_view refused_field(SetShare wanted) noexcept { return refused(wanted, wire::kSetShareFields); }
std::string_view refused_field(UseField wanted) {
  if (wanted.materials.size() > field::Field::kMostMaterials) return "materials";  // the Writer truncates them
  if (wanted.fixtures.size() > field::Field::kMostFixtures) return "fixtures";
  if (wanted.tables.size() > field::Field::kMostTables) return "tables";
  wanted.channel = 0;
  wanted.generation = 1;
  return refused<kMaxDatagram>(wanted, wire::kUseFieldFields);
}

std::string_view objection(const ForceCommand& command) noexcept {
  if (in_bounds(command)) return {};
  if (!command.force.allFinite()) return "the force is not finite (NaN or infinity)";
  if (!all_bounded(command.force)) return "the force exceeds 1e12 N";
  if (command.torque && !command.torque->torque.allFinite()) return "the torque is not finite (NaN or infinity)";
  if (command.torque && !all_bounded(command.torque->torque)) return "the torque exceeds 1e12 N·m";
  if (command.torque && !in_bounds({.torque = command.torque})) {
    return "its rotation model has a number out of bounds (WIRE.md), or an orientation whose length is not 1";
  }
  if (command.grip_force && !bounded(*command.grip_force)) return "the grip force is not finite, or exceeds 1e12 N";
  return "its stiffness, radius, contact or error is not finite, or out of the bounds in WIRE.md";
}

}  // namespace tendon
