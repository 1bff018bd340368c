// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "core/base/rotation.h"
#include "protocol/limits.h"
#include "protocol/wire/codec.h"
#include "protocol/wire/generated/frame_fields.h"
#include "protocol/wire/generated/request_fields.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/read_back.h"
#include "tests/support/dice.h"

// Random frames: mostly ordinary, some with difficult values.

namespace tendon::drawn {

using examples::Bytes;
using wire::Counts;
using wire::Entries;
using wire::Field;
using wire::Name;
using wire::Period;
using wire::Within;

inline double a_number(Dice& dice) {
  constexpr std::array kHard = {0.0,
                                -0.0,
                                limits::kMaxValue,
                                -limits::kMaxValue,
                                std::numeric_limits<double>::min(),
                                std::numeric_limits<double>::denorm_min()};
  return dice.chance(0.2) ? kHard[dice.bits() % kHard.size()] : dice.within(-10, 10);
}
inline std::uint64_t a_count(Dice& dice) { return dice.chance(0.1) ? 0 : dice.bits() >> (dice.bits() % 64); }
inline Duration a_time(Dice& dice) {
  const auto ns = static_cast<std::int64_t>(a_count(dice) >> 4U);
  return Duration(dice.chance(0.2) ? -ns : ns);
}

/// A visitor of lists (wire/fields/field.h) that gives each field a value within its bound.
class Draw {
 public:
  struct Config {
    double present = 0.3;  ///< share of the optional fields
    double spoilt = 0;     ///< share of the numbers that are out of bounds
    bool full = false;     ///< all fields are there and take as many bytes as they can
  };
  explicit Draw(Dice& dice, const Config& config) : dice_(dice), config_(config) {}
  bool sound() const { return sound_; }  ///< false if two fields contradict each other

  template <class Count>
  void count(auto /*field*/, Name /*name*/, Count& value, Counts bound = {}) {
    const std::uint64_t most = std::min<std::uint64_t>(bound.most, std::numeric_limits<Count>::max());
    const std::uint64_t drawn = bound.most == Counts{}.most ? a_count(dice_) : dice_.bits() % (most + 1);
    value = static_cast<Count>(config_.full ? most : std::max(bound.least, drawn));
    if (spoils()) value = static_cast<Count>(dice_.bits());
  }
  void flag(auto /*field*/, Name /*name*/, bool& value) { value = there(); }
  template <class Enum>
  void choice(auto /*field*/, Name /*name*/, Enum& value, Enum first, Enum last, unsigned /*offset*/ = 0) {
    const auto least = static_cast<unsigned>(first);
    const unsigned choices = static_cast<unsigned>(last) - least + 1;
    value = config_.full ? last : static_cast<Enum>(least + dice_.bits() % choices);
    if (spoils()) value = static_cast<Enum>(dice_.bits() % 256);
  }
  void duration(auto /*field*/, Name /*name*/, Duration& value, Duration most = limits::kMaxTime) {
    value = config_.full ? most : std::chrono::abs(a_time(dice_)) % most;
    if (spoils()) value = -value;
  }
  void period(auto /*field*/, Name /*name*/, Duration& value, const Period& bound) {
    const auto span = static_cast<std::uint64_t>((bound.most - bound.least).count());
    value = config_.full ? bound.most : bound.least + Duration(static_cast<std::int64_t>(dice_.bits() % (span + 1)));
    if (spoils()) value = -value;
  }
  void difference(auto /*field*/, Name /*name*/, Duration& value) {
    value = config_.full ? limits::kMaxTime : a_time(dice_);
  }
  template <class Time>
  void time(auto /*field*/, Name /*name*/, Time& value) {
    value = Time(config_.full ? limits::kMaxTime : a_time(dice_));
  }
  void bits(auto /*field*/, Name /*name*/, std::uint32_t& value) {
    value = config_.full ? ~0U : static_cast<std::uint32_t>(a_count(dice_));
  }
  void number(auto /*field*/, Name /*name*/, double& value, const Within& bound = {}) { value = a_double(bound); }
  void present(auto /*field*/, Name /*name*/, double& value, const Within& bound = {}) { value = a_double(bound); }
  void present(auto f, Name name, std::uint32_t& value, Counts bound) { count(f, name, value, bound); }
  void radius(auto /*field*/, Name /*name*/, double& value) { value = a_double({.least = 0, .infinity = true}); }
  void vector(auto /*field*/, Name name, Vec3& value) {
    value = {a_double(), a_double(), a_double()};
    if (std::string_view(name) == "normal") value = dice_.direction();
  }
  void vector_unless_zero(auto f, Name name, Vec3& value) { vector(f, name, value); }
  void normal(auto /*field*/, Name /*name*/, Vec3& value) {
    value = config_.full ? Vec3(0.6, 0.64, 0.48) : dice_.direction();
  }
  void rotation(auto /*field*/, Name /*name*/, Quat& value) {
    value = config_.full ? Quat{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5}
            : dice_.chance(0.2)
                ? Quat{.w = 0, .x = 1, .y = 0, .z = 0}
                : unit({dice_.within(-1, 1), dice_.within(-1, 1), dice_.within(-1, 1), dice_.within(0.1, 1)});
  }
  void matrix(auto /*field*/, Name /*name*/, Mat3& value) {
    value = a_double() * Mat3::Identity();
    if (!config_.full && dice_.chance(0.3)) return;
    value.diagonal() = Vec3(a_double(), a_double(), a_double());
    if (!config_.full && dice_.chance(0.4)) return;
    for (Eigen::Index i = 0; i < value.size(); ++i) value.coeffRef(i) = a_double();
  }
  void numbers(auto /*field*/, Name /*name*/, auto& value, auto& size, std::size_t least = 0,
               const Within& bound = {}) {
    const std::size_t drawn = config_.full ? value.size() : least + dice_.bits() % (value.size() - least + 1);
    size = static_cast<std::remove_reference_t<decltype(size)>>(drawn);
    for (std::size_t i = 0; i < drawn; ++i) value[i] = a_double(bound);
  }
  void joints(auto f, auto /*velocities*/, Name name, std::optional<Joints>& value) {
    if (!there()) return;
    value.emplace();
    numbers(f, name, value->velocity, value->count, 1);
    for (std::size_t i = 0; i < value->count; ++i) value->angle[i] = a_double();
  }
  void counts(auto /*field*/, Name /*name*/, auto& value) {
    for (auto& entry : value) entry = dice_.bits() % (config_.full ? ~0ULL : 16);
  }
  void text(auto /*field*/, Name /*name*/, std::string& value, std::size_t most) { value = a_text(most); }
  void texts(auto /*field*/, Name /*name*/, std::vector<std::string>& value, Entries bound, std::size_t most) {
    value.resize(entries(bound));
    for (std::string& entry : value) entry = a_text(most);
  }
  /// A span refers to static memory.
  template <class Bytes>
  void bytes(auto /*field*/, Name /*name*/, Bytes& value, Entries bound) {
    static const std::vector<std::byte> kBytes = [] {
      std::vector<std::byte> drawn(4096);
      for (Dice dice(1); std::byte & byte : drawn) byte = static_cast<std::byte>(1 + dice.bits() % 255);
      return drawn;
    }();
    const std::size_t size = spoils() ? dice_.bits() % (bound.most + 2) : entries(bound);
    const auto drawn = std::span(kBytes).subspan(dice_.bits() % 1000, size);
    if constexpr (requires { value.fill({}); }) {
      std::copy_n(drawn.begin(), std::min(size, value.size()), value.begin());
    } else {
      value = Bytes(drawn.begin(), drawn.end());
    }
  }
  void messages(auto /*field*/, Name /*name*/, auto& value, Entries bound, auto list) {
    value.resize(entries(bound));
    for (auto& entry : value) list(*this, entry);
  }
  void message(auto /*field*/, Name /*name*/, auto& value, auto list) { list(*this, value); }
  template <class Value>
  void message(auto /*field*/, Name /*name*/, std::optional<Value>& value, auto list) {
    if (there()) list(*this, value.emplace());
  }
  template <class Value>
  void maybe(auto f, Name name, std::optional<Value>& value, const Within& bound = {}) {
    if (!there()) return;
    if constexpr (std::is_same_v<Value, double>) {
      number(f, name, value.emplace(), bound);
    } else if constexpr (std::is_same_v<Value, Quat>) {
      rotation(f, name, value.emplace());
    } else {
      vector(f, name, value.emplace());
    }
  }
  void matrix(auto f, Name name, std::optional<Mat3>& value) {
    if (there()) matrix(f, name, value.emplace());
  }
  void part(auto f, auto& value, auto fields) {
    if (!value && there()) value.emplace();
    rest(f, value, fields);
    if constexpr (requires { value->generation; }) {
      if (value && value->generation == 0) value.reset();
    }
  }
  void rest(auto /*field*/, auto& value, auto fields) {
    if (value) fields(*value);
  }
  void box(auto f, auto /*most*/, Name name, auto& value) {
    if (!there()) return;
    std::remove_reference_t<decltype(*value)> box{};
    vector(f, name, box.min);
    box.max = box.min.cwiseAbs();
    value = box;
  }
  template <class Value>
  bool arm(auto /*field*/, Name /*name*/, wire::Kind<Value> /*unused*/, auto& one, auto list) {
    const bool taken = dice_.chance(0.15);  // of none, `one` keeps its usual value
    if (taken) list(*this, wire::make_arm<Value>(one));
    return taken;
  }
  void one_of(Name /*name*/, auto... /*arms*/) {}
  void require(Name /*name*/, auto holds) { sound_ = sound_ && holds(); }

 private:
  bool there() { return config_.full || dice_.chance(config_.present); }
  bool spoils() { return config_.spoilt > 0 && dice_.chance(config_.spoilt); }
  std::size_t entries(Entries bound) {
    return config_.full ? bound.most : bound.least + dice_.bits() % (bound.most - bound.least + 1);
  }
  double a_double(const Within& bound = {}) {
    constexpr std::array kBad = {kNan, kInf, -kInf, 2 * limits::kMaxValue};
    if (spoils()) return kBad[dice_.bits() % kBad.size()];
    if (config_.full) return bound.holds(-0.1) ? -0.1 : 0.1;
    if (bound.infinity && dice_.chance(0.1)) return kInf;
    const double number = a_number(dice_);
    if (bound.holds(number)) return number;
    return bound.holds(-number) ? -number : dice_.within(std::max(bound.least, -10.0), std::min(bound.most, 10.0));
  }
  std::string a_text(std::size_t most) {
    if (config_.full) return std::string(most, 'x');
    std::string text(dice_.bits() % (most + 1), 'x');
    if (text.size() > 1 && dice_.chance(0.3)) text.replace(text.size() - 2, 2, "µ");
    return text;
  }

  Dice& dice_;
  Config config_;
  bool sound_ = true;
};

constexpr auto fields_of(const DeviceState& /*unused*/) { return wire::kDeviceStateFields; }
constexpr auto fields_of(const ForceCommand& /*unused*/) { return wire::kForceCommandFields; }
constexpr auto fields_of(const Control& /*unused*/) { return wire::kControlFields; }
constexpr auto fields_of(const ControlAck& /*unused*/) { return wire::kControlAckFields; }
constexpr auto fields_of(const Bye& /*unused*/) { return wire::kByeFields; }
constexpr auto fields_of(const LinkReport& /*unused*/) { return wire::kLinkReportFields; }
constexpr auto fields_of(const DeviceReport& /*unused*/) { return wire::kDeviceReportFields; }
constexpr auto fields_of(const PeerReport& /*unused*/) { return wire::kPeerReportFields; }
constexpr auto fields_of(const PortFrame& /*unused*/) { return wire::kPortStateFields; }
constexpr auto fields_of(const FieldBrick& /*unused*/) { return wire::kFieldBrickFields; }
constexpr auto fields_of(const FieldStatus& /*unused*/) { return wire::kFieldStatusFields; }
constexpr auto fields_of(const FieldPose& /*unused*/) { return wire::kFieldPoseFields; }

template <class Value>
Value a(Dice& dice, const Draw::Config& config = {}) {
  for (;;) {
    Value value;
    Draw draw(dice, config);
    fields_of(value)(draw, value);
    if (draw.sound() || config.spoilt > 0 || config.full) return value;
  }
}

/// Of any kind.
template <std::size_t kIndex = std::variant_size_v<Frame> - 1>
Frame a_frame(Dice& dice, const Draw::Config& config = {}) {
  if constexpr (kIndex > 0) {
    if (dice.bits() % (kIndex + 1) != 0) return a_frame<kIndex - 1>(dice, config);
  }
  return a<std::variant_alternative_t<kIndex, Frame>>(dice, config);
}

/// All its fields are within bounds.
template <class Value>
Value the_fullest() {
  Dice dice(1);
  return a<Value>(dice, {.full = true});
}

inline std::optional<OutgoingEcho> an_echo(Dice& dice) {
  if (dice.chance(0.1)) return {};
  OutgoingEcho echo;
  Draw draw(dice, {});
  wire::kEchoFields(draw, echo);
  return echo;
}

/// Returns the states of one step for columns, of one, two or all devices. A share `spoilt` is invalid.
inline std::vector<DeviceState> states_of_a_step(Dice& dice, double spoilt) {
  const auto common = a<DeviceState>(dice);
  std::vector<DeviceState> states;
  const double share = dice.chance(0.5) ? 1 : 0.2;
  const bool usual = dice.chance(0.5);
  for (std::uint32_t device = 0; device < limits::kMaxDevices; ++device) {
    if (!dice.chance(share) && device > 0) continue;
    auto state = a<DeviceState>(dice, {.present = 0, .spoilt = dice.chance(spoilt) ? 0.1 : 0});
    state.tick = common.tick;
    state.sampled = common.sampled;
    state.device = device;
    if (usual) {
      state.reasons = 1;
      state.force_sequence = 1'000'000 + device;
      state.force_age = Duration(1'500'000);
      state.channel = state.buttons = 0;
    }
    states.push_back(state);
  }
  return states;
}

/// A few frames. A share `spoilt` of them is invalid.
inline Bytes a_datagram(Dice& dice, double spoilt) {
  std::array<std::byte, kMaxDatagram> buffer{};
  DataWriter writer;
  writer.begin(buffer, {.connection_id = 7}, LocalTime(a_time(dice)), an_echo(dice));
  const std::vector<DeviceState> together =
      dice.chance(0.2) ? states_of_a_step(dice, 0.1 * spoilt) : std::vector<DeviceState>();
  std::vector<const DeviceState*> columns;
  for (const DeviceState& state : together) columns.push_back(&state);
  if (!columns.empty()) writer.add(std::span<const DeviceState* const>(columns));
  for (std::uint64_t left = dice.chance(0.8) ? 1 : dice.bits() % 9; left > 0; --left) {
    const Draw::Config config{.spoilt = dice.chance(spoilt) ? 0.1 : 0};
    const Frame frame = dice.chance(0.3)   ? a_frame(dice, config)
                        : dice.chance(0.5) ? Frame(a<DeviceState>(dice, config))
                                           : Frame(a<ForceCommand>(dice, config));
    std::visit([&](const auto& value) { writer.add(value); }, frame);
  }
  return {buffer.begin() + kHeaderSize, buffer.begin() + static_cast<std::ptrdiff_t>(writer.size())};
}

}  // namespace tendon::drawn
