// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/request_bounds.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string_view>
#include <utility>

namespace tendon::conformance {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

constexpr double kLargestQuantity = 1e12;
constexpr double kLeastAboveZero = std::numeric_limits<double>::denorm_min();
constexpr double kEndless = std::numeric_limits<double>::infinity();
constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

/// The bounds of a number or an enumeration, or of the length of a text in bytes.
struct Bounds {
  std::string_view field;  ///< path from Control
  double least;
  double most;
};

constexpr Bounds kBounds[] = {
    {"set_state_rate.device", 0, 15},
    {"rearm.device", 0, 15},
    {"disarm.device", 0, 15},
    {"describe.device", 0, 15},
    {"take_lease.device", 0, 15},
    {"take_lease.channel", 0, 7},
    {"give_lease.device", 0, 15},
    {"give_lease.channel", 0, 7},
    {"lease_lost.device", 0, 15},
    {"lease_lost.channel", 0, 7},
    {"lease_lost.to", 0, 64},
    {"set_state_deadband.share", -kLargestQuantity, kLargestQuantity},
    {"set_state_deadband.floor_mps", -kLargestQuantity, kLargestQuantity},
    {"set_output.device", 0, 15},
    {"set_output.output", 0, 7},
    {"set_output.rgb", 0, 0xFFFFFF},
    {"set_output.vibration.amplitude", 0, 1},
    {"set_output.vibration.frequency_hz", 0, 1000},
    {"set_output.vibration.duration_ms", 0, 10'000},
    {"couple.device", 0, 15},
    {"couple.channel", 0, 7},
    {"couple.role", 1, 2},
    {"couple.method", 1, 7},
    {"couple.position_scale", 0.01, 100},
    {"couple.force_scale", 0.01, 100},
    {"couple.axes", 1, 7},
    {"couple.stiffness_npm", 0, kLargestQuantity},
    {"couple.mutual_damping_nspm", 0, kLargestQuantity},
    {"couple.damping_nspm", 0, kLargestQuantity},
    {"couple.period_us", 1, 10'000'000},
    {"couple.turn_stiffness_nmprad", 0, kLargestQuantity},
    {"couple.turn_damping_nmsprad", 0, kLargestQuantity},
    {"couple.grip_stiffness_npm", 0, kLargestQuantity},
    {"couple.grip_damping_nspm", 0, kLargestQuantity},
    {"couple.drift_rate_per_s", 0, kLargestQuantity},
    {"couple.rate.dead_zone_m", 0, kLargestQuantity},
    {"couple.rate.gain_per_s", kLeastAboveZero, kLargestQuantity},
    {"couple.rate.max_speed_mps", kLeastAboveZero, kLargestQuantity},
    {"engage.device", 0, 15},
    {"disengage.device", 0, 15},
    {"set_scale.device", 0, 15},
    {"set_scale.position_scale", 0.01, 100},
    {"set_scale.force_scale", 0.01, 100},
    {"set_share.device", 0, 15},
    {"set_share.channel", 0, 7},
    {"set_share.share", 0, 1},
};

std::string_view front(std::string_view path) { return path.substr(0, path.find('.')); }
std::string_view rest(std::string_view path) { return path.substr(path.find('.') + 1); }

const FieldDescriptor& field_of(const Message& message, std::string_view name) {
  return *message.GetDescriptor()->FindFieldByName(std::string(name));
}

double value_of(const Message& message, const FieldDescriptor& field) {
  const auto& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.GetUInt32(message, &field);
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection.GetEnumValue(message, &field);
    case FieldDescriptor::CPPTYPE_STRING:
      return static_cast<double>(reflection.GetString(message, &field).size());
    default:
      return reflection.GetDouble(message, &field);
  }
}

void set_value(Message& message, const FieldDescriptor& field, double value) {
  const auto& reflection = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.SetUInt32(&message, &field, static_cast<std::uint32_t>(value));
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection.SetEnumValue(&message, &field, static_cast<int>(value));
    case FieldDescriptor::CPPTYPE_STRING:
      return reflection.SetString(&message, &field, std::string(static_cast<std::size_t>(value), 'x'));
    default:
      return reflection.SetDouble(&message, &field, value);
  }
}

bool beyond(const Message& message, std::string_view path, const Bounds& bounds) {
  const FieldDescriptor& field = field_of(message, front(path));
  const auto& reflection = *message.GetReflection();
  if (field.has_presence() && !reflection.HasField(message, &field)) return false;
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
    return beyond(reflection.GetMessage(message, &field), rest(path), bounds);
  }
  const double value = value_of(message, field);
  return !(value >= bounds.least && value <= bounds.most);
}

/// Creates the messages on the path if they do not exist.
void at(Message& message, std::string_view path, const std::function<void(Message&, const FieldDescriptor&)>& use) {
  const FieldDescriptor& field = field_of(message, front(path));
  if (field.cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) return use(message, field);
  at(*message.GetReflection()->MutableMessage(&message, &field), rest(path), use);
}

std::vector<double> values_beyond(const FieldDescriptor& field, const Bounds& bounds) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return {std::nextafter(bounds.least, -kEndless), std::nextafter(bounds.most, kEndless), kEndless, -kEndless,
              kNotANumber};
    case FieldDescriptor::CPPTYPE_STRING:
      return {bounds.most + 1};
    default:
      if (bounds.least > 0) return {bounds.least - 1, bounds.most + 1};
      return {bounds.most + 1};
  }
}

pb::Control sound(std::string_view path) {
  pb::Control out;
  if (path.starts_with("couple")) {
    pb::Couple& couple = *out.mutable_couple();
    couple.set_role(pb::PORT_ROLE_LEADER);
    couple.set_method(pb::COUPLING_METHOD_RATE);
    couple.set_position_scale(1);
    couple.set_force_scale(1);
    couple.mutable_rotation()->set_w(1);
    couple.set_axes(7);
    couple.set_period_us(1000);
    couple.mutable_rate()->set_gain_per_s(1);
    couple.mutable_rate()->set_max_speed_mps(1);
  } else if (path.starts_with("set_output.vibration")) {
    out.mutable_set_output()->mutable_vibration();
  } else if (path.starts_with("set_output")) {
    out.mutable_set_output()->set_rgb(0);
  } else if (path.starts_with("set_scale")) {
    out.mutable_set_scale()->set_position_scale(1);
    out.mutable_set_scale()->set_force_scale(1);
  }
  return out;
}

}  // namespace

std::vector<BadRequest> requests_out_of_bounds() {
  std::vector<BadRequest> out;
  const auto add = [&](std::string_view path, const std::function<void(pb::Control&)>& spoil) {
    BadRequest& bad = out.emplace_back(BadRequest{.field = std::string(rest(path)), .control = sound(path)});
    spoil(bad.control);
  };
  for (const Bounds& bounds : kBounds) {
    std::vector<double> values;
    pb::Control scratch;
    at(scratch, bounds.field, [&](Message&, const FieldDescriptor& field) { values = values_beyond(field, bounds); });
    for (const double value : values) {
      add(bounds.field, [&](pb::Control& control) {
        at(control, bounds.field, [&](Message& of, const FieldDescriptor& field) { set_value(of, field, value); });
      });
    }
  }
  add("set_output.setting", [](pb::Control& control) { control.mutable_set_output()->clear_setting(); });
  add("set_output.vibration.frequency_hz", [](pb::Control& control) {
    control.mutable_set_output()->mutable_vibration()->set_frequency_hz(std::nextafter(20, 0));
  });
  for (const double w : {0.0, 0.998, 1.002, kNotANumber}) {
    add("couple.rotation", [w](pb::Control& control) { control.mutable_couple()->mutable_rotation()->set_w(w); });
  }
  add("couple.rotation", [](pb::Control& control) { control.mutable_couple()->clear_rotation(); });
  return out;
}

std::string field_out_of_bounds(const pb::Control& control) {
  for (const Bounds& bounds : kBounds) {
    if (beyond(control, bounds.field, bounds)) return std::string(rest(bounds.field));
  }
  if (control.has_set_output()) {
    const pb::SetOutput& wanted = control.set_output();
    if (wanted.setting_case() == pb::SetOutput::SETTING_NOT_SET) return "setting";
    const double hz = wanted.vibration().frequency_hz();
    if (hz > 0 && hz < 20) return "vibration.frequency_hz";
  }
  if (control.has_couple()) {
    const pb::Quat& q = control.couple().rotation();
    const double norm = std::sqrt(q.w() * q.w() + q.x() * q.x() + q.y() * q.y() + q.z() * q.z());
    if (!(std::abs(norm - 1) <= 0.001)) return "rotation";
  }
  return {};
}

}  // namespace tendon::conformance
