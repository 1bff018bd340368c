// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <limits>
#include <memory>
#include <numbers>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include "devices/simulated/profiles.h"
#include "devices/simulated/recorded_motion.h"
#include "protocol/limits.h"
#include "server/scene/recorded_hand.h"

// In three parts: how values are written (units, rules); which keys there are (the declarations); what
// walks over the declarations (Reader fills a Draft from a file, Reference prints them) and what is done
// with the Draft. A new key is one line in the second part.

namespace tendon {
namespace {

// --- How values are written ---------------------------------------------------------------------------

/// The end of a key's name tells its unit.
struct Unit {
  std::string_view suffix;
  std::string_view symbol;
  double per_si;  ///< a whole number: dividing by it rounds once, so 43 µm is the same double as 0.000043
};

constexpr Unit kNoUnit = {"", "", 1};

/// Longest suffix first.
constexpr std::array kUnits = {
    Unit{"_n_s_per_m", "N·s/m", 1},
    Unit{"_m_per_s2", "m/s²", 1},
    Unit{"_m_per_s", "m/s", 1},
    Unit{"_n_per_m", "N/m", 1},
    Unit{"_n_per_s", "N/s", 1},
    Unit{"_n_m_s", "N·m·s/rad", 1},
    Unit{"_n_m", "N·m", 1},
    Unit{"_hz", "Hz", 1},
    Unit{"_kg", "kg", 1},
    Unit{"_ma", "mA", 1e3},
    Unit{"_mj", "mJ", 1e3},
    Unit{"_mm", "mm", 1e3},
    Unit{"_ms", "ms", 1e3},
    Unit{"_um", "µm", 1e6},
    Unit{"_us", "µs", 1e6},
    Unit{"_m", "m", 1},
    Unit{"_n", "N", 1},
};

const Unit& unit_of(std::string_view key) {
  const auto* const found =
      std::find_if(kUnits.begin(), kUnits.end(), [key](const Unit& unit) { return key.ends_with(unit.suffix); });
  return found == kUnits.end() ? kNoUnit : *found;
}

std::string with_symbol(std::string text, const Unit& unit) {
  if (!unit.symbol.empty()) text.append(" ").append(unit.symbol);
  return text;
}

/// The shortest text that reads back as `value`; without an exponent where a person would use none.
std::string digits(double value) {
  std::array<char, 32> text{};
  const double size = std::abs(value);
  const bool plain = size == 0 || (size >= 1e-4 && size < 1e9);
  const auto end = plain ? std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::fixed).ptr
                         : std::to_chars(text.data(), text.data() + text.size(), value).ptr;
  return {text.data(), end};
}

std::string in_quotes(std::string_view text) { return '"' + std::string(text) + '"'; }

/// What the file has, in the words of an error.
std::string found_in(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::string:
      return in_quotes(**node.as_string());
    case toml::node_type::integer:
      return std::to_string(**node.as_integer());
    case toml::node_type::floating_point:
      return digits(**node.as_floating_point());
    case toml::node_type::boolean:
      return **node.as_boolean() ? "true" : "false";
    case toml::node_type::array:
      return "an array of " + std::to_string(node.as_array()->size());
    case toml::node_type::table:
      return "a table";
    default:
      return "a date or time";
  }
}

std::optional<double> number_in(const toml::node& node) {
  if (const auto* integer = node.as_integer()) return static_cast<double>(**integer);
  if (const auto* number = node.as_floating_point()) return **number;
  return std::nullopt;
}

/// Why a value is not accepted; none when it is.
struct Refusal {
  const toml::node* found;
  std::string expected;
};
using Verdict = std::optional<Refusal>;

// A rule says which values a key may have: `expected` in words, `take` converts one to SI, `shown` is the
// way back, for the defaults in the reference.

/// The longest time in a scene. Nothing in a haptic loop is meant to last an hour, and sums of times stay small.
constexpr Duration kLongest = limits::kMaxTimeout;

/// A number in the key's unit.
struct Number {
  double least = -limits::kMaxValue;
  double most = limits::kMaxValue;
  bool without_least = false;
  bool or_infinite = false;

  std::string expected(const Unit& unit) const {
    std::string text;
    if (least <= -limits::kMaxValue) {
      text = unit.symbol.empty() ? "a number" : "a number of " + std::string(unit.symbol);
    } else if (most < limits::kMaxValue) {
      text =
          without_least ? "a number above " + digits(least) + " and up to " : "a number from " + digits(least) + " to ";
      text += with_symbol(digits(most), unit);
    } else if (without_least) {
      text = with_symbol("a number above " + digits(least), unit);
    } else {
      text = with_symbol("a number of " + digits(least), unit) + " or more";
    }
    return or_infinite ? text + ", or inf" : text;
  }

  Verdict take(const toml::node& node, const Unit& unit, double& to) const {
    const auto number = number_in(node);
    if (auto refusal = check(node, unit, number, most)) return refusal;
    to = *number / unit.per_si;
    return {};
  }

  Verdict take(const toml::node& node, const Unit& unit, Duration& to) const {
    const auto number = number_in(node);
    if (auto refusal = check(node, unit, number, std::min(most, seconds(kLongest) * unit.per_si))) return refusal;
    const Duration rounded(std::llround(*number * (1e9 / unit.per_si)));
    if (without_least && rounded <= Duration::zero()) return Refusal{&node, expected(unit)};
    to = rounded;
    return {};
  }

  template <class T>
  Verdict take(const toml::node& node, const Unit& unit, std::optional<T>& to) const {
    T value{};
    if (auto refusal = take(node, unit, value)) return refusal;
    to = value;
    return {};
  }

  static std::string shown(const Unit& unit, double value) { return digits(value * unit.per_si); }
  static std::string shown(const Unit& unit, Duration value) {
    return digits(static_cast<double>(value.count()) / (1e9 / unit.per_si));
  }
  template <class T>
  static std::string shown(const Unit& unit, const std::optional<T>& value) {
    return value ? shown(unit, *value) : "none";
  }

 private:
  Verdict check(const toml::node& node, const Unit& unit, std::optional<double> number, double limit) const {
    if (number && or_infinite && *number == std::numeric_limits<double>::infinity()) return {};
    const bool too_small = number && !(without_least ? *number > least : *number >= least);  // a NaN too
    if (!number || too_small) return Refusal{&node, expected(unit)};
    if (*number <= limit) return {};
    return Refusal{&node, limit < most || most >= limits::kMaxValue
                              ? with_symbol("a number of at most " + digits(limit), unit)
                              : expected(unit)};
  }
};

constexpr Number kAnyNumber{};
constexpr Number kZeroOrMore{.least = 0};
constexpr Number kAboveZero{.least = 0, .without_least = true};
constexpr Number kAboveZeroOrInf{.least = 0, .without_least = true, .or_infinite = true};

/// A number of the device's effects: what is `false` does not exist.
struct OrFalse {
  Number number;

  std::string expected(const Unit& unit) const { return number.expected(unit) + ", or false for none"; }

  template <class T>
  Verdict take(const toml::node& node, const Unit& unit, std::optional<T>& to) const {
    if (const auto* none = node.as_boolean(); none != nullptr && !**none) {
      to.reset();
      return {};
    }
    if (auto refusal = number.take(node, unit, to)) return Refusal{&node, expected(unit)};
    return {};
  }

  template <class T>
  static std::string shown(const Unit& unit, const std::optional<T>& value) {
    return Number::shown(unit, value);
  }
};

struct Count {
  std::int64_t most;
  std::int64_t least = 0;

  std::string expected(const Unit&) const {
    return "a whole number from " + std::to_string(least) + " to " + std::to_string(most);
  }

  template <class Whole>
  Verdict take(const toml::node& node, const Unit& unit, Whole& to) const {
    const auto* count = node.as_integer();
    if (count == nullptr || **count < least || **count > most) return Refusal{&node, expected(unit)};
    to = static_cast<Whole>(**count);
    return {};
  }

  template <class Whole>
  Verdict take(const toml::node& node, const Unit& unit, std::optional<Whole>& to) const {
    return take(node, unit, to.emplace());
  }

  template <class Whole>
  static std::string shown(const Unit&, Whole value) {
    return std::to_string(value);
  }
  template <class Whole>
  static std::string shown(const Unit&, const std::optional<Whole>& value) {
    return value ? std::to_string(*value) : "none";
  }
};

/// A point or a direction.
struct Vector {
  static std::string expected(const Unit& unit) {
    return unit.symbol.empty() ? "[x, y, z]" : "[x, y, z] in " + std::string(unit.symbol);
  }

  static Verdict take(const toml::node& node, const Unit& unit, Vec3& to) {
    const auto* array = node.as_array();
    if (array == nullptr || array->size() != 3) return Refusal{&node, expected(unit)};
    Vec3 vector;
    for (Eigen::Index i = 0; i < 3; ++i) {
      if (auto refusal = kAnyNumber.take(*array->get(static_cast<std::size_t>(i)), unit, vector[i])) return refusal;
    }
    to = vector;
    return {};
  }

  static Verdict take(const toml::node& node, const Unit& unit, std::optional<Vec3>& to) {
    return take(node, unit, to.emplace());
  }

  static std::string shown(const Unit& unit, const Vec3& value) {
    return "[" + Number::shown(unit, value.x()) + ", " + Number::shown(unit, value.y()) + ", " +
           Number::shown(unit, value.z()) + "]";
  }
  static std::string shown(const Unit& unit, const std::optional<Vec3>& value) {
    return value ? shown(unit, *value) : "none";
  }
};

template <class Rule>
struct ListOf {
  Rule rule;

  std::string expected(const Unit& unit) const { return "[…], of which each is " + rule.expected(unit); }

  template <class T>
  Verdict take(const toml::node& node, const Unit& unit, std::vector<T>& to) const {
    const auto* array = node.as_array();
    if (array == nullptr) return Refusal{&node, expected(unit)};
    to.clear();
    for (const toml::node& element : *array) {
      if (auto refusal = rule.take(element, unit, to.emplace_back())) return refusal;
    }
    return {};
  }

  template <class T>
  static std::string shown(const Unit&, const std::vector<T>&) {
    return "[]";
  }
};

/// The name of a device or a channel.
bool in_a_label(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_'; }

/// The nearest label to any text.
std::string label_of(std::string text) {
  text.resize(std::min(text.size(), limits::kMaxLabel));
  for (char& c : text) c = in_a_label(c) ? c : '-';
  return text.empty() ? "device" : text;
}

struct Label {
  static std::string expected(const Unit&) {
    return "a name of 1 to " + std::to_string(limits::kMaxLabel) + " letters, digits, - or _";
  }

  static Verdict take(const toml::node& node, const Unit& unit, std::string& to) {
    const auto* text = node.as_string();
    const bool good = text != nullptr && !(*text)->empty() && (*text)->size() <= limits::kMaxLabel &&
                      std::all_of((*text)->begin(), (*text)->end(), in_a_label);
    if (!good) return Refusal{&node, expected(unit)};
    to = **text;
    return {};
  }

  static std::string shown(const Unit&, const std::string& value) { return in_quotes(value); }
};

/// Where a USB device is plugged in, in the kernel's words.
struct UsbPort {
  static std::string expected(const Unit&) { return "a port as `tendond devices` names it, like \"1-2.3\""; }

  static Verdict take(const toml::node& node, const Unit& unit, std::string& to) {
    constexpr std::size_t kLongestPort = 32;  // 7 tiers of hubs are the most there can be
    const auto* text = node.as_string();
    const auto in_a_port = [](char c) { return (c >= '0' && c <= '9') || c == '-' || c == '.'; };
    const bool good = text != nullptr && !(*text)->empty() && (*text)->size() <= kLongestPort &&
                      std::all_of((*text)->begin(), (*text)->end(), in_a_port);
    if (!good) return Refusal{&node, expected(unit)};
    to = **text;
    return {};
  }

  static std::string shown(const Unit&, const std::string& value) { return in_quotes(value); }
};

/// An arm of Haptikfabriken's whose kinematics are published.
struct ArmModel {
  static std::string expected(const Unit&) {
    std::string text = "one of ";
    for (const auto& model : woodenhaptics::models()) {
      text += (&model == woodenhaptics::models().data() ? "" : ", ") + in_quotes(model.name);
    }
    return text;
  }

  static Verdict take(const toml::node& node, const Unit& unit, const woodenhaptics::Model*& to) {
    const auto* text = node.as_string();
    to = text != nullptr ? woodenhaptics::find_model(**text) : nullptr;
    if (to != nullptr) return {};
    const bool closed = text != nullptr && woodenhaptics::has_unpublished_kinematics(**text);
    return Refusal{&node, expected(unit) + (closed ? " (Polhem v2 and v3 have a closed linkage, whose kinematics their "
                                                     "makers have not published)"
                                                   : "")};
  }

  static std::string shown(const Unit&, const woodenhaptics::Model* model) {
    return model != nullptr ? in_quotes(model->name) : "none";
  }
};

struct YesNo {
  static std::string expected(const Unit&) { return "true or false"; }

  static Verdict take(const toml::node& node, const Unit& unit, bool& to) {
    const auto* truth = node.as_boolean();
    if (truth == nullptr) return Refusal{&node, expected(unit)};
    to = **truth;
    return {};
  }

  static std::string shown(const Unit&, bool value) { return value ? "true" : "false"; }
};

/// A force sensor: there or not, with the size of one count.
struct Sensor {
  static std::string expected(const Unit&) {
    return "the size of one count in N, 0 for an exact one, or false for none";
  }

  static Verdict take(const toml::node& node, const Unit& unit,
                      std::optional<SimulatedDevice::Config::ForceSensor>& to) {
    std::optional<double> count;
    if (OrFalse{kZeroOrMore}.take(node, unit, count)) return Refusal{&node, expected(unit)};
    to.reset();
    if (!count) return {};
    to.emplace();
    if (*count > 0) to->resolution = *count;
    return {};
  }

  static std::string shown(const Unit&, const std::optional<SimulatedDevice::Config::ForceSensor>&) { return "false"; }
};

struct Path {
  static std::string expected(const Unit&) { return "a path in quotes"; }

  static Verdict take(const toml::node& node, const Unit& unit, std::filesystem::path& to) {
    const auto* text = node.as_string();
    if (text == nullptr || (*text)->empty()) return Refusal{&node, expected(unit)};
    to = **text;
    return {};
  }

  static Verdict take(const toml::node& node, const Unit& unit, std::optional<std::filesystem::path>& to) {
    return take(node, unit, to.emplace());
  }

  static std::string shown(const Unit&, const std::filesystem::path& value) { return in_quotes(value.string()); }
  static std::string shown(const Unit&, const std::optional<std::filesystem::path>&) { return "none"; }
};

struct Column {
  static std::string expected(const Unit&) { return "a column's name in quotes or its number, from 0"; }

  static Verdict take(const toml::node& node, const Unit& unit, RecordedMotionFile::Column& to) {
    if (const auto* name = node.as_string(); name != nullptr && !(*name)->empty()) {
      to = **name;
      return {};
    }
    const auto* number = node.as_integer();
    if (number == nullptr || **number < 0) return Refusal{&node, expected(unit)};
    to = static_cast<std::size_t>(**number);
    return {};
  }

  static std::string shown(const Unit&, const RecordedMotionFile::Column& value) {
    const auto* name = std::get_if<std::string>(&value);
    return name != nullptr ? in_quotes(*name) : std::to_string(std::get<std::size_t>(value));
  }
};

/// Where this server listens.
struct ListenAddress {
  static std::string expected(const Unit&) { return "an address like \"127.0.0.1:47100\" or \"[::1]:47100\""; }

  static Verdict take(const toml::node& node, const Unit& unit, Address& to) {
    const auto* text = node.as_string();
    if (text == nullptr) return Refusal{&node, expected(unit)};
    try {
      to = parse_address(**text);
      return {};
    } catch (const std::invalid_argument&) {
      return Refusal{&node, expected(unit)};
    }
  }

  static std::string shown(const Unit&, const Address& value) { return in_quotes(to_string(value)); }
};

/// One of a few names.
template <class T>
struct Names {
  std::vector<std::pair<std::string_view, T>> all;

  std::string expected(const Unit&) const {
    std::string text = all.size() == 1 ? "" : "one of ";
    for (const auto& [name, value] : all) text += (name == all.front().first ? "" : ", ") + in_quotes(name);
    return text;
  }

  Verdict take(const toml::node& node, const Unit& unit, T& to) const {
    const auto* text = node.as_string();
    if (text == nullptr) return Refusal{&node, expected(unit)};
    for (const auto& [name, value] : all) {
      if (name != **text) continue;
      to = value;
      return {};
    }
    return Refusal{&node, expected(unit)};
  }

  std::string shown(const Unit&, const T& wanted) const {
    for (const auto& [name, value] : all) {
      if (value == wanted) return in_quotes(name);
    }
    return "none";
  }
};

// --- Which keys there are -----------------------------------------------------------------------------

/// A scene while it is read: what depends on several keys is still open.
struct Draft {
  Draft() {
    // 1 N per step at 1 kHz: a hand cannot tell the ramp from a step, and a force that flips its sign at every
    // datagram loses its edge.
    scene.loop.control.max_slew = 1000;
  }

  Scene scene;
  const DeviceProfile* profile = nullptr;
  const OperatorProfile* operator_profile = nullptr;
  std::optional<Vec3> joint_coulomb;
  OperatorHand::Config hand{0, 0, 0, ScriptedMotion(ScriptedMotion::Sine{})};  // not listed: not there, so 0
  bool has_hand = false;
  ScriptedMotion::Script motion = ScriptedMotion::Sine{};
  std::optional<RecordedMotionFile> recorded_motion;
  std::optional<std::filesystem::path> replayed;  ///< a recording of tendond
  std::optional<Duration> longest_hold;
  std::optional<double> coulomb_bound;
  std::optional<double> viscous_bound;
  std::optional<double> max_force;
  std::optional<double> ledger_step;
  /// 8.5 N on a handle of 75 g that nobody holds are 113 m/s²; a tap is some 200 (control.md 8.7).
  double most_acceleration = 300;
  /// With more, delayed walls stay passive but buzz (control.md 8.7).
  double shaping_viscous = 0.3;
  std::vector<Vec3> places;
  std::vector<double> place_coulomb;
  std::vector<double> place_viscous;
  double reach = 0.05;
};

/// What holds when a key is not there, where that is not simply the value of the target.
struct Absent {
  bool required = false;
  std::string_view text = {};
};
constexpr Absent kRequired = {.required = true};

enum class DeviceKind : std::uint8_t { kSimulated, kFalcon, kReplay, kSpaceMouse, kWoodenHaptics };
enum class MechanismKind : std::uint8_t { kFalcon, kArm };
enum class MotionKind : std::uint8_t { kSine, kRampHold, kMinimumJerk, kRecorded };

Names<const DeviceProfile*> profile_names() {
  Names<const DeviceProfile*> names;
  for (const DeviceProfile& profile : device_profiles()) names.all.emplace_back(profile.name, &profile);
  return names;
}

Names<const OperatorProfile*> operator_names() {
  Names<const OperatorProfile*> names;
  for (const OperatorProfile& profile : operator_profiles()) names.all.emplace_back(profile.name, &profile);
  return names;
}

Names<MotionKind> motion_names() {
  return {{{"sine", MotionKind::kSine},
           {"ramp-hold", MotionKind::kRampHold},
           {"minimum-jerk", MotionKind::kMinimumJerk},
           {"recorded", MotionKind::kRecorded}}};
}

Names<ScriptedMotion::Recorded::AtEnd> at_end_names() {
  using enum ScriptedMotion::Recorded::AtEnd;
  return {{{"hold", kHold}, {"repeat", kRepeat}}};
}

Names<Law> law_names() {
  Names<Law> names;
  for (const LawInfo& law : laws()) names.all.emplace_back(law.name, law.law);
  return names;
}

template <class Table>
void declare_joint_friction(Table& friction, Draft& draft, JointFriction::Config& config) {
  const Names<MechanismKind> kinds{{{"falcon", MechanismKind::kFalcon}, {"arm", MechanismKind::kArm}}};
  friction.kind(kinds, [&](Table& keys, MechanismKind kind) {
    if (kind == MechanismKind::kArm) {
      auto& arm = config.mechanism.emplace<Mechanism::Arm>();
      keys.key("upper_arm_mm", arm.upper_arm, Number{.least = 10, .most = 1e4}, "of a Phantom's: shoulder to elbow",
               kRequired);
      keys.key("forearm_mm", arm.forearm, Number{.least = 10, .most = 1e4}, "elbow to handle", kRequired);
    }
    keys.key("coulomb_n_m", draft.joint_coulomb, Vector{}, "Coulomb friction of each joint, in place of the handle's",
             Absent{.text = "so much that coulomb_friction_n is the least at any place and in any direction"});
    keys.key("viscous_n_m_s", config.viscous, Vector{}, "viscous friction of each joint, besides the handle's");
    keys.key("centre_mm", config.centre, Vector{}, "where the middle of the mechanism's workspace lies");
  });
}

template <class Table>
void declare_effects(Table& effects, Draft& draft) {
  const DeviceProfile* const profile = draft.profile;
  SimulatedDevice::Config& device = draft.scene.device;
  constexpr OrFalse kDelay{Number{.least = 0, .most = 100, .without_least = true}};
  constexpr OrFalse kEffect{kAboveZero};
  constexpr Absent kProfiles{.text = "the profile's; without a profile there is no such effect"};
  effects.key("mass_kg", device.mass, kAboveZero, "apparent mass at the handle",
              Absent{.required = profile == nullptr, .text = "the profile's; required without a profile"});
  effects.key("viscous_friction_n_s_per_m", device.viscous_friction, kEffect, "true viscous friction", kProfiles);
  effects.key("coulomb_friction_n", device.coulomb_friction, kEffect, "true Coulomb friction", kProfiles);
  effects.key("encoder_step_um", device.encoder_step, kEffect, "one encoder count, on each axis", kProfiles);
  effects.key("max_force_n", device.max_force, kEffect, "the device clamps the force vector to this length", kProfiles);
  effects.key("amplifier_bandwidth_hz", device.amplifier_bandwidth, kEffect,
              "the motors follow the command with this bandwidth (-3 dB, first order)", kProfiles);
  effects.key("force_sensor", device.force_sensor, Sensor{},
              "measures the force of the hand: what a device of admittance type has", kProfiles);
  effects.key("watchdog_ms", device.watchdog, kEffect,
              "the device drops the force when it gets no command for this long", kProfiles);
  effects.key("sample_delay_ms", device.sample_delay, kDelay, "positions come so late, and say when they were taken");
  effects.key("force_delay_ms", device.force_delay, kDelay, "so late do forces reach the motors");
  effects.part("joint_friction", device.joint_friction, [&draft](Table& friction, JointFriction::Config& config) {
    declare_joint_friction(friction, draft, config);
  });
  effects.part(
      "structural_mode", device.structural_mode, [](Table& keys, SimulatedDevice::Config::StructuralMode& mode) {
        keys.key("handle_mass_kg", mode.handle_mass, kAboveZero, "of mass_kg, what is on the hand's side of the spring",
                 kRequired);
        keys.key("stiffness_n_per_m", mode.stiffness, kAboveZero, "of the spring between motors and handle", kRequired);
        keys.key("damping_n_s_per_m", mode.damping, kZeroOrMore, "beside it");
      });
}

template <class Table>
void declare_csv(Table& keys, RecordedMotionFile& file) {
  keys.key("file", file.path, Path{}, "CSV file, relative to the scene file", kRequired);
  keys.key("time_column", file.time, Column{}, "time in s");
  keys.key("position_column", file.position, Column{}, "position along a line", kRequired);
  keys.key("scale_m", file.scale, kAnyNumber, "how long one unit of the position is; negative turns it round");
  keys.key("origin_mm", file.origin, Vector{}, "where position 0 lies");
  keys.key("direction", file.direction, Vector{}, "of the line; its length does not count");
}

template <class Table>
void declare_motion(Table& motion, Draft& draft) {
  motion.kind(motion_names(), [&draft](Table& keys, MotionKind kind) {
    switch (kind) {
      case MotionKind::kSine: {
        auto& sine = std::get<ScriptedMotion::Sine>(draft.motion = ScriptedMotion::Sine{});
        keys.key("amplitude_mm", sine.amplitude, kZeroOrMore, "to either side of the centre", kRequired);
        keys.key("frequency_hz", sine.frequency, kZeroOrMore, "cycles per second", kRequired);
        keys.key("centre_mm", sine.centre, Vector{}, "where it starts");
        keys.key("direction", sine.direction, Vector{}, "where it moves first; its length does not count");
        return;
      }
      case MotionKind::kRampHold: {
        auto& ramp = std::get<ScriptedMotion::RampHold>(draft.motion = ScriptedMotion::RampHold{});
        keys.key("from_mm", ramp.from, Vector{}, "where it starts", kRequired);
        keys.key("to_mm", ramp.to, Vector{}, "where it goes at constant speed", kRequired);
        keys.key("ramp_ms", ramp.ramp, kAboveZero, "for how long it goes", kRequired);
        keys.key("hold_ms", ramp.hold, kZeroOrMore, "for how long it rests at either end, to and fro for ever",
                 Absent{.text = "it goes once and stays"});
        return;
      }
      case MotionKind::kMinimumJerk: {
        auto& reach = std::get<ScriptedMotion::MinimumJerk>(draft.motion = ScriptedMotion::MinimumJerk{});
        keys.key("points_mm", reach.points, ListOf<Vector>{}, "2 or more points, at rest at each", kRequired);
        keys.key("durations_ms", reach.durations, ListOf<Number>{kAboveZero}, "of the ways between them", kRequired);
        keys.key("back_and_forth", reach.back_and_forth, YesNo{}, "for ever; else it stays at the last point");
        return;
      }
      case MotionKind::kRecorded: {
        auto& file = draft.recorded_motion.emplace();
        declare_csv(keys, file);
        keys.key("at_end", file.at_end, at_end_names(), "stay at the last sample, or start again");
        return;
      }
    }
  });
}

template <class Table>
void declare_port(Table& keys, std::string& port) {
  keys.key("port", port, UsbPort{}, "where it is plugged in, when there are several",
           Absent{.text = "the first that nobody uses"});
}

template <class Table>
void declare_falcon(Table& keys, Draft& draft) {
  draft.scene.device = find_device_profile("falcon")->device();
  Scene::Falcon& falcon = draft.scene.falcon.emplace(Scene::Falcon{});
  declare_port(keys, falcon.port);
  keys.key("firmware", falcon.firmware, Path{},
           "the file of your own Novint software, relative to this file; --falcon-firmware overrides it",
           Absent{.text = "none; only a device that has its firmware already can be used"});
  keys.key("accept_unknown_firmware", falcon.accept_unknown_firmware, YesNo{},
           "also a file that is none of the known ones");
}

/// What stands in where the cost of a step is measured.
SimulatedDevice::Config stand_in(const char* name) {
  SimulatedDevice::Config device;
  device.name = name;
  device.mass = 0.1;
  return device;
}

template <class Table>
void declare_replay(Table& keys, Draft& draft) {
  draft.scene.device = stand_in("replay");
  ReplayDevice::Config& replay = draft.scene.replay.emplace();
  keys.key("recording", draft.replayed, Path{},
           "MCAP recording of tendond, relative to this file: the hand of its (first) device",
           Absent{.text = "none; then there is a table csv"});
  keys.key("at_end", replay.at_end, at_end_names(), "stay at the last sample, or start again");
  keys.key("encoder_step_um", replay.position_resolution, kZeroOrMore,
           "one count of the device that was recorded; 0: its positions were exact");
  keys.part("csv", draft.recorded_motion, [](Table& csv, RecordedMotionFile& file) { declare_csv(csv, file); });
}

template <class Table>
void declare_spacemouse(Table& keys, Draft& draft) {
  draft.scene.device = stand_in("spacemouse");
  Scene::SpaceMouse& mouse = draft.scene.spacemouse.emplace(Scene::SpaceMouse{});
  declare_port(keys, mouse.port);
  keys.key("speed_m_per_s", mouse.motion.speed, kAboveZero, "of the position, with the cap at its stop");
  keys.key("dead_band", mouse.motion.dead_band, Number{.least = 0, .most = 0.9},
           "share of the way to the stop in which nothing moves");
  keys.key("reach_mm", mouse.motion.reach, kAboveZero, "the position stays within so much of the origin, on each axis");
}

template <class Table>
void declare_woodenhaptics(Table& keys, Draft& draft) {
  draft.scene.device = stand_in("woodenhaptics");
  draft.scene.device.watchdog = WoodenHapticsDevice::kWatchdog;
  Scene::WoodenHaptics& arm = draft.scene.woodenhaptics.emplace(Scene::WoodenHaptics{});
  declare_port(keys, arm.port);
  keys.key("model", arm.drive.model, ArmModel{}, "which arm it is", kRequired);
  keys.key("max_current_ma", arm.drive.max_current, Number{.least = 1, .most = 6000},
           "of each motor; what the amplifiers can give is the most");
}

template <class Table>
void declare_device(Table& device, Draft& draft) {
  const Names<DeviceKind> kinds{{{"simulated", DeviceKind::kSimulated},
                                 {"falcon", DeviceKind::kFalcon},
                                 {"replay", DeviceKind::kReplay},
                                 {"spacemouse", DeviceKind::kSpaceMouse},
                                 {"woodenhaptics", DeviceKind::kWoodenHaptics}}};
  device.kind(kinds, [&draft](Table& keys, DeviceKind kind) {
    keys.key("name", draft.scene.name, Label{}, "what clients call it that want this one of several",
             Absent{.text = "the name of the scene file"});
    if (kind == DeviceKind::kFalcon) {
      declare_falcon(keys, draft);
      return;
    }
    if (kind == DeviceKind::kReplay) {
      declare_replay(keys, draft);
      return;
    }
    if (kind == DeviceKind::kSpaceMouse) {
      declare_spacemouse(keys, draft);
      return;
    }
    if (kind == DeviceKind::kWoodenHaptics) {
      declare_woodenhaptics(keys, draft);
      return;
    }
    SimulatedDevice::Config& config = draft.scene.device;
    keys.key("profile", draft.profile, profile_names(), "a real device's effects; keys below override one each");
    if (draft.profile != nullptr) config = draft.profile->device();
    keys.key("start_position_mm", config.start_position, Vector{}, "of the handle",
             Absent{.text = "where the hand starts, or the origin"});
    keys.table("effects", [&draft](Table& effects) { declare_effects(effects, draft); });
    draft.has_hand = keys.optional_table("hand", [&draft](Table& hand) {
      hand.key("profile", draft.operator_profile, operator_names(),
               "what holds the handle: the middle of what is known of such; keys below override one number each");
      const OperatorProfile* const profile = draft.operator_profile;
      if (profile != nullptr) draft.hand = profile->hand(std::move(draft.hand.motion));
      constexpr Absent kProfiles{.text = "the profile's; 0 without a profile"};
      hand.key("stiffness_n_per_m", draft.hand.stiffness, kAboveZero, "of the grip",
               Absent{.required = profile == nullptr, .text = "the profile's; required without a profile"});
      hand.key("damping_n_s_per_m", draft.hand.damping, kZeroOrMore, "of the grip", kProfiles);
      hand.key("mass_kg", draft.hand.mass, kZeroOrMore, "moves with the handle", kProfiles);
      hand.key("button_after_ms", draft.scene.device.button_after, kZeroOrMore,
               "after this time it presses button 0, and holds it", Absent{.text = "never"});
      hand.table("motion", [&draft](Table& motion) { declare_motion(motion, draft); });
    });
  });
}

enum class WorkspaceShape : std::uint8_t { kSphere, kBox };

template <class Table>
void declare_workspace(Table& workspace, Workspace::Config& config) {
  const Names<WorkspaceShape> shapes{{{"sphere", WorkspaceShape::kSphere}, {"box", WorkspaceShape::kBox}}};
  workspace.kind(shapes, [&config](Table& keys, WorkspaceShape shape) {
    if (shape == WorkspaceShape::kSphere) {
      auto& sphere = config.shape.emplace<Workspace::Sphere>();
      keys.key("radius_mm", sphere.radius, kAboveZero, "of the space in which forces are whole", kRequired);
    } else {
      auto& box = config.shape.emplace<Workspace::Box>();
      keys.key("half_mm", box.half, Vector{}, "half the edges of the space in which forces are whole", kRequired);
    }
    keys.key("centre_mm", config.centre, Vector{}, "of that space");
    keys.key("margin_mm", config.margin, kAboveZero, "so far beyond it nothing pushes outwards any more", kRequired);
  });
}

template <class Table>
void declare_watchdog(Table& keys, Watchdog::Config& dog, std::string_view meaning) {
  keys.key("timeout_ms", dog.timeout, kAboveZero, meaning, kRequired);
  keys.key("ramp_ms", dog.ramp, kZeroOrMore, "then what is asked for falls to nothing within this time");
}

/// The safety layer: there when its table is, as is each part of it.
template <class Table>
void declare_safety(Table& safety, SafeDevice::Config& config) {
  using By = SafeDevice::Arming::By;
  safety.key(
      "arm", config.arming.by,
      Names<By>{{{"by request", By::kRequest}, {"at start", By::kStart}, {"by dead man", By::kDeadMan}}},
      "what gives forces, at first and after a fault: a guest's request (rearm); the first time nobody, then that; "
      "or nothing but pressing the dead man's button");
  safety.key("rest_speed_m_per_s", config.arming.rest_speed, kAboveZero,
             "armed is only a handle that was no faster for 50 ms");
  safety.key("rest_force_n", config.arming.rest_force, kAboveZero, "… and of which no more force is asked");
  safety.key("patience_ms", config.arming.patience, kAboveZero, "a request to arm is open for so long");
  safety.part("force_limit", config.force_limit, [](Table& keys, ForceLimit::Config& part) {
    keys.key("max_n", part.max, kAboveZero, "no force is longer; its direction is kept", kRequired);
  });
  safety.part("growth_limit", config.growth_limit, [](Table& keys, GrowthLimit::Config& part) {
    keys.key("rate_n_per_s", part.rate, kAboveZero, "no force grows faster; it falls at once", kRequired);
  });
  safety.part("ramp_in", config.ramp_in, [](Table& keys, RampIn::Config& part) {
    keys.key("time_ms", part.time, kAboveZero, "after arming, from nothing to the whole force", kRequired);
  });
  safety.part("heat_limit", config.heat_limit, [](Table& keys, HeatLimit::Config& part) {
    keys.key("peak_n", part.peak, kAboveZero, "of cool motors", kRequired);
    keys.key("continuous_n", part.continuous, kAboveZero, "what they bear for ever. Not above peak_n", kRequired);
    keys.key("time_constant_ms", part.time_constant, kAboveZero, "with which they heat up", kRequired);
  });
  safety.part("workspace", config.workspace,
              [](Table& keys, Workspace::Config& part) { declare_workspace(keys, part); });
  safety.part("speed_trip", config.speed_trip, [](Table& keys, SpeedTrip::Config& part) {
    keys.key("max_m_per_s", part.max, kAboveZero, "a handle that is faster gets no force any more", kRequired);
  });
  safety.part("step_bound", config.step_bound, [](Table& keys, StepBound::Config& part) {
    keys.key("max_speed_m_per_s", part.max_speed, kAboveZero,
             "as in [loop], and unarmed: a position that no hand comes to at this speed", kRequired);
  });
  safety.part("command_watchdog", config.command_watchdog, [](Table& keys, Watchdog::Config& part) {
    declare_watchdog(keys, part, "the loop stood still for longer");
  });
  safety.part("link_watchdog", config.link_watchdog, [](Table& keys, Watchdog::Config& part) {
    declare_watchdog(keys, part, "the newest position is older");
  });
  safety.part("dead_man", config.dead_man, [](Table& keys, DeadManSwitch::Config& part) {
    keys.key("button", part.button, Count{31}, "no force unless it is held", kRequired);
  });
}

/// The parts of AOL+: each is there when its table is.
template <class Table>
void declare_parts(Table& limiter, Draft& draft) {
  using Plus = AolPlus<1, 3>;
  Plus::Parts& parts = draft.scene.loop.control.limiter.parts;
  limiter.part("energy_cap", parts.energy_cap, [](Table& keys, Plus::EnergyCap& cap) {
    keys.key("energy_mj", cap.energy, kZeroOrMore, "credit that outlasts the contact in which it was earned");
    keys.key("most_contact_mj", cap.most_contact, kZeroOrMore, "the most that one contact adds to that");
  });
  limiter.part("robust_ledger", parts.robust_ledger, [&draft](Table& keys, Plus::Robust& robust) {
    keys.key("encoder_step_um", draft.ledger_step, kZeroOrMore, "one encoder count: credit is never due to rounding",
             Absent{.text = "the device's; required when the device has none"});
    keys.key("window", robust.window, Count{1000, 1}, "haptic periods for each credit of viscous friction");
  });
  limiter.part("knee", parts.knee, [](Table& keys, Plus::Knee& knee) {
    keys.key("start", knee.start, Number{.least = 0.01, .most = 0.99},
             "share of the bound from which on forces are compressed instead of clipped");
  });
  limiter.part("latency_reserve", parts.latency_reserve, [](Table& keys, Plus::LatencyReserve& reserve) {
    keys.key("holds", reserve.holds, Count{Plus::kMostHolds, 1},
             "periods from when a force is chosen to when the device begins to hold it. Not with bounded_acceleration");
  });
  limiter.part("bounded_acceleration", parts.bounded_acceleration, [&draft](Table& keys, Plus::BoundedAcceleration&) {
    keys.key("most_m_per_s2", draft.most_acceleration, kAboveZero,
             "the handle never accelerates harder: the largest forces of hand and motors, over the apparent mass");
    keys.key("shaping_viscous_n_s_per_m", draft.shaping_viscous, kAboveZero,
             "stiffness stays below twice this over the longest hold. Not below the viscous friction");
  });
  limiter.part("adaptive_friction", parts.adaptive_friction, [&draft](Table& keys, Plus::AdaptiveFriction& adaptive) {
    keys.key("rise_ms", adaptive.rise, kAboveZero, "time constant with which the bounds may rise; they fall at once");
    keys.key("places_mm", draft.places, ListOf<Vector>{}, "where the friction was identified", kRequired);
    keys.key("coulomb_friction_n", draft.place_coulomb, ListOf<Number>{kZeroOrMore},
             "lower bound at each of the places", kRequired);
    keys.key("viscous_friction_n_s_per_m", draft.place_viscous, ListOf<Number>{kZeroOrMore}, "the same", kRequired);
    keys.key("reach_mm", draft.reach, kZeroOrMore,
             "in use is the least of the nearest place and of all within this distance of the hand");
  });
}

Names<OutputEstimator::Model> estimator_models() {
  using enum OutputEstimator::Model;
  return {{{"polynomial", kPolynomial}, {"spring-and-bias", kSpringAndBias}, {"output-error", kOutputError}}};
}

/// How the force follows the hand between two arrivals, when not as the engine said. One table or none.
template <class Table>
void declare_between(Table& force, HeldForce::Config& hold) {
  force.part("adaptive_local_model", hold.adaptive_local_model, [](Table& keys, AdaptiveLocalModel::Config& config) {
    keys.key("share", config.share, Number{.least = 0.01, .most = 1},
             "of the stiffness that the engine sends; below 1 when that is an estimate itself");
    keys.key("max_blend_ms", config.max_blend, kAboveZero, "a new model is blended in for one engine period, or this");
  });
  force.part("output_estimator", hold.output_estimator, [](Table& keys, OutputEstimator::Config& config) {
    keys.key("model", config.model, estimator_models(), "what the environment is taken for, on each axis");
    keys.key("origin_mm", config.origin, Vector{}, "where the environment is at rest");
    keys.key("scale_mm", config.scale, kAboveZero, "about the travel in the environment");
    keys.key("forgetting", config.forgetting, Number{.least = 0.5, .most = 1}, "what is left of a weight per answer");
    keys.key("dead_zone_n", config.dead_zone, kZeroOrMore, "smaller errors teach nothing: the noise of the engine");
    keys.key("reset_error_n", config.reset_error, kAboveZero, "a larger error is another environment");
    keys.key("reset_cooldown", config.reset_cooldown, Count{1000, 1}, "answers before the next one can be");
    keys.key("max_stiffness_n_per_m", config.max_stiffness, kAboveZero, "nothing stiffer is believed");
    keys.key("largest_n", config.max_force, kAboveZero, "no estimate is larger, on each axis");
    keys.key("resolution_um", config.resolution, kZeroOrMore, "one encoder count: less motion teaches nothing");
  });
}

/// What one law wants to know and others do not.
template <class Table>
void declare_law(Table& limiter, Draft& draft) {
  LimiterConfig& config = draft.scene.loop.control.limiter;
  const auto used_by = [&config](std::initializer_list<Law> users) {
    return Table::kDocuments || std::find(users.begin(), users.end(), config.law) != users.end();
  };
  if (used_by({Law::kClamp})) {
    limiter.key("clamp_n", config.max_force, kZeroOrMore, "of \"clamp\": no force is longer than this", kRequired);
  }
  if (used_by({Law::kReferenceEnergy, Law::kPortHamiltonian, Law::kPassiveSynthesis})) {
    limiter.key(
        "environment_stiffness_n_per_m", config.environment_stiffness, kAboveZero,
        "of \"reference-energy\", \"port-hamiltonian\", \"passive-synthesis\": of an environment that sends no "
        "stiffness of its own",
        Absent{.required = info(config.law).needs_stiffness,
               .text = "required, but for \"passive-synthesis\", which then learns it from forces that bring one"});
  }
  if (used_by({Law::kPassiveSynthesis})) {
    limiter.key("environment_delay_ms", config.environment_delay, kZeroOrMore,
                "of \"passive-synthesis\": from a position to the force that answers it");
  }
  if (used_by({Law::kPassivityController, Law::kPassivityControllerPublished, Law::kReferenceEnergy})) {
    limiter.key("max_damping_n_s_per_m", config.max_damping, kAboveZero,
                "of \"tdpa\", \"tdpa-2002\", \"reference-energy\": the most damping that is injected. Far below twice "
                "the device's mass over the period");
  }
  if (used_by({Law::kAolPlus})) declare_parts(limiter, draft);
}

/// 250 Hz to 10 kHz. At 250 Hz the stiffest wall that felt clean was 0.325 N/mm (Choi and Tan, IROS 2004); 100 µs is
/// about what an ordinary kernel wakes a thread too late.
constexpr Number kPeriod{.least = 100, .most = 4000};
/// The four of its grip: right, forward, centre, left.
constexpr std::uint32_t kFalconButtons = 4;
/// N: how long the forces of engines may be that nobody feels, so that recordings have them as they came.
constexpr double kUnfelt = 10;
/// Readings may fail for so long before it is a fault: what libfranka allows.
constexpr Duration kMostMissed = std::chrono::milliseconds(20);
/// What fits into the kernel's set.
constexpr Count kProcessor{1023};
/// The wire tells timeouts in whole ms.
constexpr Number kTimeout{.least = 1, .most = limits::kMaxTimeout / std::chrono::milliseconds(1)};
/// Each costs 250 bytes per haptic step: 1000 are 2 Gbit/s at 1 kHz.
constexpr Count kObservers{1000};

template <class Table>
void declare_scene(Table& scene, Draft& draft) {
  scene.table("device", [&draft](Table& device) { declare_device(device, draft); });

  scene.table("loop", [&draft](Table& loop) {
    loop.key("period_us", draft.scene.loop.period, kPeriod, "from one haptic step to the next");
    loop.key("longest_hold_us", draft.longest_hold, kAboveZero,
             "T_max of the limiter: a force held for longer is an overrun. Not below the period",
             Absent{.text = "2 periods"});
    loop.key("max_speed_m_per_s", draft.scene.loop.control.max_speed, kAboveZero,
             "a position that no hand comes to at this speed is a fault: an encoder that wraps or loses count",
             Absent{.text = "every position is believed"});
    loop.key("cpu", draft.scene.cpu, kProcessor, "the processor on which the haptic thread stays: an isolated one",
             Absent{.text = "wherever the kernel puts it"});
  });

  scene.part("safety", draft.scene.safety,
             [](Table& safety, SafeDevice::Config& config) { declare_safety(safety, config); });

  scene.table("limiter", [&draft](Table& limiter) {
    LimiterConfig& config = draft.scene.loop.control.limiter;
    constexpr Absent kProfiles{.text = "the profile's; required without a profile, unless kind is \"none\""};
    limiter.key("kind", config.law, law_names(),
                "keeps the device from giving out energy. \"none\" is for simulated devices only");
    limiter.key("coulomb_friction_n", draft.coulomb_bound, kZeroOrMore,
                "lower bound of the device's Coulomb friction (aol-per-axis, aol-box: of each axis by itself)",
                kProfiles);
    limiter.key("viscous_friction_n_s_per_m", draft.viscous_bound, kZeroOrMore,
                "lower bound of the device's viscous friction", kProfiles);
    declare_law(limiter, draft);
  });

  scene.part("admittance", draft.scene.loop.control.admittance, [](Table& keys, AdmittanceLoop<3>::Config& tool) {
    // The tool is the same in every direction.
    const auto each = [&keys](const char* name, Vec3& target, const Number& rule, const char* meaning, Absent absent) {
      double value = target.x();
      keys.key(name, value, rule, meaning, absent);
      target.setConstant(value);
    };
    tool.mass.setZero();
    tool.proportional.setZero();
    each("mass_kg", tool.mass, kAboveZero, "of the tool that the hand is to feel", kRequired);
    each("damping_n_s_per_m", tool.damping, kZeroOrMore, "of the tool", {});
    each("stiffness_n_per_m", tool.stiffness, kZeroOrMore, "ties the tool to where it was at the start", {});
    each("proportional_n_s_per_m", tool.proportional, kZeroOrMore, "gain of the loop that makes the handle follow",
         kRequired);
    each("integral_n_per_m", tool.integral, kZeroOrMore, "its integral gain", {});
  });

  scene.table("force", [&draft](Table& force) {
    HapticController::Config& control = draft.scene.loop.control;
    force.key("max_force_n", draft.max_force, kAboveZero, "no force is longer than this",
              Absent{.text = "the device's; required when the device has none, 10 N when it exerts no forces"});
    force.key("max_slew_n_per_s", control.max_slew, kAboveZeroOrInf, "no force changes faster than this");
    force.key("hold_ms", control.hold.hold, kZeroOrMore, "a force is held for this long after its validity ends");
    force.key("decay_ms", control.hold.decay, kAboveZero, "time constant of its fading after that");
    force.key("safe_stop_ms", control.hold.safe_stop, kZeroOrMore,
              "zero force this long after validity ends. Not below hold_ms");
    force.key("ramp_in_ms", control.hold.ramp_in, kZeroOrMore, "the first force is ramped in for this long");
    force.key("max_valid_for_ms", control.hold.max_valid_for, kAboveZero,
              "a force is valid for no longer than this, whatever its sender asks for");
    force.key("max_stiffness_n_per_m", control.hold.max_stiffness, kAboveZero,
              "of what an engine sends with its forces, nothing stiffer is followed");
    declare_between(force, control.hold);
  });

  scene.tables("channel", draft.scene.channels, limits::kMaxChannels, [](Table& keys, Scene::Channel& channel) {
    keys.key("name", channel.name, Label{}, "what clients call it that want this one of several", kRequired);
    keys.key("rule", channel.rule,
             Names<ChannelRule>{{{"sum", ChannelRule::kSum}, {"priority", ChannelRule::kPriority}}},
             "its force is added to the others; or it silences those of this rule that come after it, as long as it is "
             "fresh, and is faded in and out for ramp_in_ms");
    keys.key("lease_ms", channel.lease, Number{.least = 0, .most = limits::kMaxTimeout / std::chrono::milliseconds(1)},
             "another client may take it from one that has sent no force for so long; 0: it stays until it leaves");
  });

  scene.table("network", [&draft](Table& keys) {
    Scene::Network& network = draft.scene.network;
    keys.key("listen", network.listen, ListenAddress{},
             "port 0 lets the system choose one. Without keys a loopback address");
    keys.key("keys", network.keys, Path{},
             "folder with a file NAME.key for each client, relative to this file; only they are let in");
    keys.key("max_observers", network.max_observers, kObservers, "guests besides the controller");
    keys.key("controller_timeout_ms", network.controller_timeout, kTimeout, "a controller silent for so long has left");
    keys.key("observer_timeout_ms", network.observer_timeout, kTimeout, "an observer silent for so long has left");
    keys.key("adapt_state_rate", network.adapt_state_rate, YesNo{},
             "whether states leave more rarely where the way to a guest is full, down to 1 in 20");
    keys.key("takeover", network.takeover, ListOf<Label>{},
             "names of the keys (without keys: of the clients) that may take a channel from its holder at once");
  });

  scene.optional_table("recording", [&draft](Table& recording) {
    recording.key("path", draft.scene.recording, Path{}, "MCAP file, relative to the current directory", kRequired);
  });
}

// --- What walks over the declarations -----------------------------------------------------------------

std::string joined(std::string_view path, std::string_view name) {
  return path.empty() ? std::string(name) : std::string(path) + '.' + std::string(name);
}

/// How many letters have to be added, left out, replaced or swapped with their neighbour to turn `a` into `b`.
std::size_t edits(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        d[i][j] = i + j;
        continue;
      }
      const std::size_t replaced = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({replaced, d[i - 1][j] + 1, d[i][j - 1] + 1});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

/// What the writer of an unknown key may have meant.
std::string advice(std::string_view unknown, const std::vector<std::string_view>& known) {
  for (const std::string_view key : known) {
    const Unit& unit = unit_of(key);
    const std::string_view stem = key.substr(0, key.size() - unit.suffix.size());
    const bool only_the_unit_differs = unknown == stem || unknown.starts_with(std::string(stem) + '_');
    if (!unit.suffix.empty() && only_the_unit_differs) {
      return std::string(stem) + " is given in " + std::string(unit.symbol) + ": " + std::string(key);
    }
  }
  // Beyond a third of its letters a key is another word, not a misspelt one. Longer than any key of ours: no word.
  constexpr std::size_t kLongestWord = 64;
  std::string_view closest;
  std::size_t fewest = unknown.size() <= kLongestWord ? unknown.size() / 3 + 1 : 0;
  for (const std::string_view key : known) {
    const auto [shorter, longer] = std::minmax({unknown.size(), key.size()});
    if (longer - shorter >= fewest) continue;  // that many letters are missing at least
    if (const std::size_t count = edits(unknown, key); count < fewest) {
      fewest = count;
      closest = key;
    }
  }
  if (!closest.empty()) return "did you mean " + std::string(closest) + "?";
  std::string all;
  for (const std::string_view key : known) all.append(all.empty() ? "known here: " : ", ").append(key);
  return all;
}

/// A place in the file that an error can name; line 0 is none.
struct Place {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  friend bool operator<(const Place& a, const Place& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  }
};

Place place_of(const toml::node& node) { return {node.source().begin.line, node.source().begin.column}; }

[[noreturn]] void fail(const std::string& file, Place at, const std::string& key, const std::string& sentence) {
  std::string text = file;
  if (at.line > 0) text += ':' + std::to_string(at.line);
  throw SceneError(text + ": " + key + ": " + sentence);
}

/// Of all that is wrong with a file, what to report.
class Findings {
 public:
  void wrong(Place at, std::string key, std::string sentence) { add({false, at, std::move(key), std::move(sentence)}); }
  void missing(Place at, std::string key, std::string sentence) {
    add({true, at, std::move(key), std::move(sentence)});
  }

  void throw_first(const std::string& file) const {
    if (first_) fail(file, first_->at, first_->key, first_->sentence);
  }

 private:
  struct Finding {
    bool missing;
    Place at;
    std::string key;
    std::string sentence;
  };

  void add(Finding finding) {
    const auto rank = [](const Finding& f) { return std::pair(f.missing, f.at); };
    if (!first_ || rank(finding) < rank(*first_)) first_ = std::move(finding);
  }

  std::optional<Finding> first_;
};

/// Fills the targets of one table's declarations from the file; `table` is null where the file has none.
class Reader {
 public:
  static constexpr bool kDocuments = false;

  Reader(Findings& findings, const toml::table* table, std::string path, Place place)
      : findings_(findings), table_(table), path_(std::move(path)), place_(place) {}

  template <class T, class Rule>
  bool key(std::string_view name, T& target, const Rule& rule, std::string_view /*meaning*/,
           const Absent& absent = {}) {
    const Unit& unit = unit_of(name);
    const toml::node* node = look_up(name);
    if (node == nullptr) {
      if (absent.required) {
        findings_.missing(place_, joined(path_, name), "missing, expected " + rule.expected(unit));
      }
      return false;
    }
    const Verdict refusal = rule.take(*node, unit, target);
    if (!refusal) return true;
    findings_.wrong(place_of(*refusal->found), joined(path_, name),
                    "expected " + refusal->expected + ", found " + found_in(*refusal->found));
    return false;
  }

  /// A required key that decides which others there are.
  template <class T, class Declare>
  void kind(const Names<T>& names, const Declare& declare) {
    T value{};
    kind_known_ = key("kind", value, names, "", kRequired);
    if (kind_known_) declare(*this, value);
  }

  template <class Declare>
  void table(std::string_view name, const Declare& declare) {
    const toml::node* node = look_up(name);
    if (node != nullptr && !node->is_table()) {
      findings_.wrong(place_of(*node), joined(path_, name), "expected a table, found " + found_in(*node));
      return;
    }
    Reader inner(findings_, node != nullptr ? node->as_table() : nullptr, joined(path_, name),
                 node != nullptr ? place_of(*node) : place_);
    declare(inner);
    inner.refuse_unknown();
  }

  template <class Declare>
  bool optional_table(std::string_view name, const Declare& declare) {
    const bool there = look_up(name) != nullptr;
    if (there) table(name, declare);
    return there;
  }

  /// An effect that is there when its table is.
  template <class T, class Declare>
  void part(std::string_view name, std::optional<T>& target, const Declare& declare) {
    optional_table(name, [&](Reader& keys) {
      // To clang a T whose class around it had no end yet, when it first met the optional, needs an argument.
      if constexpr (std::is_default_constructible_v<T>) {
        declare(keys, target.emplace());
      } else {
        declare(keys, target.emplace(T{}));
      }
    });
  }

  /// A table written with [[name]], for each of a few of a kind; without one `target` stays as it is.
  template <class T, class Declare>
  void tables(std::string_view name, std::vector<T>& target, std::size_t most, const Declare& declare) {
    const toml::node* node = look_up(name);
    if (node == nullptr) return;
    const std::string path = joined(path_, name);
    if (!node->is_array_of_tables() || node->as_array()->size() > most) {
      findings_.wrong(place_of(*node), path,
                      "expected 1 to " + std::to_string(most) + " tables [[" + path + "]], found " + found_in(*node));
      return;
    }
    target.clear();
    for (const toml::node& one : *node->as_array()) {
      Reader inner(findings_, one.as_table(), path + "[" + std::to_string(target.size()) + "]", place_of(one));
      declare(inner, target.emplace_back());
      inner.refuse_unknown();
    }
  }

  void refuse_unknown() const {
    if (table_ == nullptr || !kind_known_) return;
    for (const auto& [name, node] : *table_) {
      if (std::find(known_.begin(), known_.end(), name.str()) != known_.end()) continue;
      findings_.wrong(place_of(node), joined(path_, name.str()),
                      (node.is_table() ? "unknown table; " : "unknown key; ") + advice(name.str(), known_));
    }
  }

 private:
  const toml::node* look_up(std::string_view name) {
    if (std::find(known_.begin(), known_.end(), name) == known_.end()) known_.push_back(name);
    return table_ != nullptr ? table_->get(name) : nullptr;
  }

  Findings& findings_;
  const toml::table* table_;
  std::string path_;
  Place place_;
  std::vector<std::string_view> known_;
  bool kind_known_ = true;  ///< else the table's keys are not known either
};

/// Writes the declarations down for people.
class Reference {
 public:
  static constexpr bool kDocuments = true;  ///< declare all there is, whatever depends on what

  explicit Reference(std::string& text, std::string path = {}) : text_(text), path_(std::move(path)) {}

  template <class T, class Rule>
  bool key(std::string_view name, const T& target, const Rule& rule, std::string_view meaning,
           const Absent& absent = {}) {
    const Unit& unit = unit_of(name);
    std::string without = "Default: ";
    if (!absent.text.empty()) {
      without += absent.text;
    } else if (absent.required) {
      without = "Required";
    } else {
      without += rule.shown(unit, target);
    }
    text_.append(indent_).append(name).append("\n");
    text_.append(indent_).append("    ").append(meaning).append(".\n");
    text_.append(indent_).append("    ").append(rule.expected(unit)).append(". ").append(without).append(".\n");
    return false;
  }

  template <class T, class Declare>
  void kind(const Names<T>& names, const Declare& declare) {
    for (const auto& [name, value] : names.all) {
      text_.append("  kind = ").append(in_quotes(name)).append("\n");
      Reference inner(text_, path_);
      inner.indent_ = "    ";
      declare(inner, value);
    }
  }

  template <class Declare>
  void table(std::string_view name, const Declare& declare) {
    const std::string path = joined(path_, name);
    text_.append(text_.empty() ? "[" : "\n[").append(path).append("]\n");
    Reference inner(text_, path);
    declare(inner);
  }

  template <class Declare>
  bool optional_table(std::string_view name, const Declare& declare) {
    table(name, declare);
    return true;
  }

  template <class T, class Declare>
  void part(std::string_view name, std::optional<T>&, const Declare& declare) {
    table(name, [&](Reference& keys) {
      T defaults;
      declare(keys, defaults);
    });
  }

  template <class T, class Declare>
  void tables(std::string_view name, std::vector<T>&, std::size_t most, const Declare& declare) {
    const std::string path = joined(path_, name);
    text_.append("\n[[").append(path).append("]]  at most ").append(std::to_string(most)).append("\n");
    Reference inner(text_, path);
    T defaults;
    declare(inner, defaults);
  }

 private:
  std::string& text_;
  std::string path_;
  std::string indent_ = "  ";
};

/// Turns a draft without mistakes of its own into a scene: what depends on several keys.
class Settlement {
 public:
  Settlement(Draft draft, const toml::table& file, const std::string& name)
      : draft_(std::move(draft)), file_(file), name_(name) {}

  Scene scene(const std::filesystem::path& directory) {
    settle_motion(directory);
    settle_falcon(directory);
    settle_woodenhaptics();
    settle_network(directory);
    settle_structural_mode();
    settle_joint_friction();
    settle_control();
    settle_replay(directory);
    settle_channels();
    // Rules of the constructors that are not among ours yet.
    Scene& scene = draft_.scene;
    if (draft_.has_hand) scene.device.hand = draft_.hand;
    build("device", [&scene] { SimulatedDevice{scene.device}; });
    build("force", [&scene] { HeldForce{scene.loop.control.hold}; });
    settle_safety();
    build("limiter", [&scene] { Limiter{scene.loop.control.limiter}; });
    build("loop", [&scene] { HapticController{scene.loop.control}; });
    return std::move(scene);
  }

 private:
  /// Throws. The line is that of the first of `places` that the file has; of the innermost table around the
  /// key when it has none of them.
  [[noreturn]] void blame(std::string_view key, std::initializer_list<std::string_view> places,
                          const std::string& sentence) const {
    Place place;
    const auto look = [&](std::string_view path) {
      if (const auto node = file_.at_path(path); node && place.line == 0) place = place_of(*node.node());
    };
    for (const std::string_view path : places) look(path);
    for (std::string_view path = key;; path = path.substr(0, path.rfind('.'))) {
      look(path);
      if (path.find('.') == std::string_view::npos) break;
    }
    fail(name_, place, std::string(key), sentence);
  }

  template <class Build>
  void build(std::string_view table, const Build& attempt) const {
    try {
      attempt();
    } catch (const std::invalid_argument& refused) {
      blame(table, {}, refused.what());
    }
  }

  void settle_motion(const std::filesystem::path& directory) {
    if (!draft_.has_hand) return;
    build("device.hand.motion", [&] {
      if (draft_.recorded_motion) {
        draft_.recorded_motion->path = directory / draft_.recorded_motion->path;
        try {
          draft_.motion = load_recorded_motion(*draft_.recorded_motion);
        } catch (const std::runtime_error& refused) {
          blame("device.hand.motion.file", {}, refused.what());
        }
      }
      draft_.hand.motion = ScriptedMotion(std::move(draft_.motion));
    });
  }

  void settle_falcon(const std::filesystem::path& directory) {
    if (!draft_.scene.falcon) return;
    auto& firmware = draft_.scene.falcon->firmware;
    if (firmware) firmware = directory / *firmware;
    expect_a_limiter();
  }

  void expect_a_limiter() const {
    if (draft_.scene.loop.control.limiter.law != Law::kNone) return;
    blame("limiter.kind", {}, "expected a limiter, found \"none\", which is for simulated devices only");
  }

  void settle_woodenhaptics() {
    if (!draft_.scene.woodenhaptics) return;
    const WoodenHapticsDevice::Config& drive = draft_.scene.woodenhaptics->drive;
    const Unit& unit = unit_of("max_current_ma");
    if (drive.max_current > drive.model->full_scale) {
      blame("device.max_current_ma", {},
            "expected at most " + with_symbol(Number::shown(unit, drive.model->full_scale), unit) +
                ", the full scale of its amplifiers, found " + Number::shown(unit, drive.max_current));
    }
    draft_.scene.device.max_force = drive.model->max_force;
    draft_.scene.device.encoder_step = WoodenHapticsDevice::info_of(*drive.model).position_resolution;
    expect_a_limiter();
  }

  void settle_replay(const std::filesystem::path& directory) {
    if (!draft_.scene.replay) return;
    ReplayDevice::Config& replay = *draft_.scene.replay;
    auto& csv = draft_.recorded_motion;
    if (draft_.replayed.has_value() == csv.has_value()) {
      blame("device", {}, std::string("expected either recording or a table csv, found ") + (csv ? "both" : "neither"));
    }
    const std::string_view source = csv ? "device.csv.file" : "device.recording";
    build(source, [&] {
      try {
        if (csv) csv->path = directory / csv->path;
        replay.samples = csv ? ReplayDevice::samples_of(load_recorded_motion(*csv))
                             : read_recorded_hand(directory / *draft_.replayed);
      } catch (const std::runtime_error& refused) {
        blame(source, {}, refused.what());
      }
      ReplayDevice{replay};
    });
    // Between samples the device is not seen.
    const HapticLoop::Config& loop = draft_.scene.loop;
    const Duration most = (loop.control.max_missed - 1) * loop.period;
    const auto gap = std::ranges::adjacent_find(
        replay.samples, [most](const auto& one, const auto& next) { return next.at - one.at > most; });
    if (gap != replay.samples.end()) {
      blame(source, {},
            "expected samples no further apart than " + digits(seconds(most) * 1e3) +
                " ms, because a device that is silent for longer is a fault, found " +
                digits(seconds(std::next(gap)->at - gap->at) * 1e3) + " ms at " +
                digits(seconds(gap->at - replay.samples.front().at)) + " s");
    }
  }

  void settle_structural_mode() const {
    const SimulatedDevice::Config& device = draft_.scene.device;
    if (!device.structural_mode || device.structural_mode->handle_mass < device.mass) return;
    blame("device.effects.structural_mode.handle_mass_kg", {},
          "expected less than mass_kg, of which it is a part and which is " + digits(device.mass) + " kg, found " +
              digits(device.structural_mode->handle_mass));
  }

  /// Friction is in the joints or at the handle. What is known of a device is that at the handle.
  void settle_joint_friction() {
    SimulatedDevice::Config& device = draft_.scene.device;
    if (!device.joint_friction) return;
    const std::string table = "device.effects.joint_friction";
    const std::string_view handles = "device.effects.coulomb_friction_n";
    if (draft_.joint_coulomb) {
      if (const auto node = file_.at_path(handles); node && node.is_number()) {
        blame(handles, {},
              "expected false beside coulomb_n_m of [" + table + "], found " + found_in(*node.node()) +
                  ": this friction is in the joints or at the handle");
      }
      device.joint_friction->coulomb = *draft_.joint_coulomb;
    } else if (device.coulomb_friction) {
      device.joint_friction->coulomb =
          JointFriction::torques(device.joint_friction->mechanism, *device.coulomb_friction);
    }
    device.coulomb_friction.reset();
    build(table, [&device] { JointFriction{*device.joint_friction}; });
  }

  void settle_channels() {
    Scene& scene = draft_.scene;
    scene.loop.control.channels.clear();
    for (std::size_t i = 0; i < scene.channels.size(); ++i) {
      scene.loop.control.channels.push_back(scene.channels[i].rule);
      for (std::size_t before = 0; before < i; ++before) {
        if (scene.channels[before].name != scene.channels[i].name) continue;
        blame("channel[" + std::to_string(i) + "].name", {},
              "expected a name of its own, found " + in_quotes(scene.channels[i].name) + " again");
      }
    }
  }

  void settle_safety() {
    Scene& scene = draft_.scene;
    // What moves a real hand is never without: then each part is there when it is listed, and arming always.
    if (scene.moves_a_hand() && !scene.safety) scene.safety.emplace();
    if (!scene.safety) return;
    if (scene.safety->dead_man) {
      const std::uint32_t button = scene.safety->dead_man->button;
      if (scene.falcon && button >= kFalconButtons) {
        blame("safety.dead_man.button", {}, "expected one of a Falcon's, 0 to 3, found " + std::to_string(button));
      }
      if (scene.woodenhaptics && button != 0) {
        blame("safety.dead_man.button", {}, "expected 0, the switch at its tip, found " + std::to_string(button));
      }
      if (!scene.moves_a_hand() && !(scene.device.button_after && button == 0)) {
        blame("safety.dead_man.button", {},
              "expected button 0 of a hand with button_after_ms: a simulated device has no others");
      }
    }
    build("safety", [&scene] {
      SimulatedDevice device{scene.device};
      SafeDevice{*scene.safety, device};
    });
  }

  void settle_network(const std::filesystem::path& directory) {
    Scene::Network& network = draft_.scene.network;
    if (network.keys) network.keys = directory / *network.keys;
    // UdpLink refuses it too, but has no line to name.
    if (!network.keys && !is_loopback(network.listen)) {
      blame("network.listen", {},
            "expected a loopback address like \"127.0.0.1:47100\" or \"[::1]:47100\", or a folder of keys besides: "
            "without keys anyone on the network could command forces");
    }
  }

  void settle_control() {
    const SimulatedDevice::Config& device = draft_.scene.device;
    HapticLoop::Config& loop = draft_.scene.loop;
    HapticController::Config& control = loop.control;

    // A loop without real-time priority is late by up to a period now and then; each time is an overrun beyond this.
    control.limiter.longest_hold = draft_.longest_hold.value_or(2 * loop.period);
    control.max_missed = std::max(2U, static_cast<std::uint32_t>(kMostMissed / loop.period));
    if (control.limiter.longest_hold < loop.period) {
      blame("loop.longest_hold_us", {}, at_least(loop.period, "the period", control.limiter.longest_hold, "_us"));
    }
    if (control.hold.safe_stop < control.hold.hold) {
      blame("force.safe_stop_ms", {"force.safe_stop_ms", "force.hold_ms"},
            at_least(control.hold.hold, "hold_ms", control.hold.safe_stop, "_ms"));
    }
    control.watchdog = device.watchdog.value_or(Duration::zero());
    if (control.admittance && !device.force_sensor) {
      blame("admittance", {},
            "expected a device with force_sensor among its effects: the tool is driven by the hand's force");
    }

    const std::optional<double> most = draft_.scene.exerts_force() ? device.max_force : kUnfelt;
    if (!draft_.max_force && !most) {
      blame("force.max_force_n", {}, "missing, expected a number above 0 N, because the device has no max_force_n");
    }
    control.max_force = draft_.max_force ? *draft_.max_force : *most;

    // Friction that is isotropic as a vector is less on each axis by itself: Σ f |dx_i| ≤ √3 f ‖dx‖ (control.md 1.6
    // (a)).
    const bool per_axis = control.limiter.law == Law::kAolPerAxis || control.limiter.law == Law::kAolBox;
    const DeviceProfile* profile = draft_.profile;
    const Friction truth = least_friction(device);
    control.limiter.friction.coulomb =
        friction_bound("coulomb_friction_n", draft_.coulomb_bound, profile ? &profile->coulomb_bound : nullptr,
                       truth.coulomb, per_axis ? 1 / std::numbers::sqrt3 : 1);
    control.limiter.friction.viscous = friction_bound("viscous_friction_n_s_per_m", draft_.viscous_bound,
                                                      profile ? &profile->viscous_bound : nullptr, truth.viscous, 1);
    settle_parts(control.limiter);
    settle_places(control);
  }

  /// The bounds by place may not be above the truth either, and the limiter's own hold wherever they are lower.
  void settle_places(HapticController::Config& control) const {
    if (!control.limiter.parts.adaptive_friction) return;
    const std::string table = "limiter.adaptive_friction";
    const std::size_t count = draft_.places.size();
    if (draft_.place_coulomb.size() != count || draft_.place_viscous.size() != count) {
      blame(table + ".places_mm", {}, "expected as many places as friction bounds of each kind");
    }
    const SimulatedDevice::Config& device = draft_.scene.device;
    const auto check = [&](const char* key, const std::vector<double>& bounds, double Friction::*kind) {
      for (std::size_t i = 0; i < count; ++i) {
        const double most = least_friction_at(device, draft_.places[i]).*kind;
        if (bounds[i] <= most) continue;
        blame(table + "." + key, {},
              "expected at most " + with_symbol(digits(most), unit_of(key)) +
                  ", the true friction of the simulated device" + (device.joint_friction ? " there" : "") + ", found " +
                  digits(bounds[i]));
      }
    };
    if (!draft_.scene.moves_a_hand() && draft_.scene.exerts_force()) {  // whose true friction nobody knows here
      check("coulomb_friction_n", draft_.place_coulomb, &Friction::coulomb);
      check("viscous_friction_n_s_per_m", draft_.place_viscous, &Friction::viscous);
    }
    auto& map = control.friction_map.emplace();
    map.reach = draft_.reach;
    for (std::size_t i = 0; i < count; ++i) {
      map.places.push_back(
          {draft_.places[i], {.coulomb = draft_.place_coulomb[i], .viscous = draft_.place_viscous[i]}});
    }
  }

  void settle_parts(LimiterConfig& limiter) const {
    if (limiter.parts.robust_ledger) {
      const std::optional<double> step = draft_.ledger_step ? draft_.ledger_step : draft_.scene.device.encoder_step;
      if (!step) {
        blame("limiter.robust_ledger.encoder_step_um", {},
              "missing, expected " + kZeroOrMore.expected(unit_of("_um")) +
                  ", because the device has no encoder_step_um");
      }
      limiter.parts.robust_ledger->encoder_step = {*step};
    }
    if (limiter.parts.bounded_acceleration) {
      limiter.parts.bounded_acceleration->most = {draft_.most_acceleration};
      limiter.parts.bounded_acceleration->shaping_viscous = {
          std::max(draft_.shaping_viscous, limiter.friction.viscous)};
    }
  }

  static std::string at_least(Duration least, const std::string& what, Duration found, std::string_view suffix) {
    const Unit& unit = unit_of(suffix);
    return "expected " + what + " of " + with_symbol(Number::shown(unit, least), unit) + " or more, found " +
           Number::shown(unit, found);
  }

  /// The bound that the limiter may count on. `axis_share`: of the friction, what an axis by itself has.
  double friction_bound(const std::string& key, std::optional<double> given, const KnownNumber* profiles, double truth,
                        double axis_share) const {
    const std::string full = "limiter." + key;
    const Unit& unit = unit_of(key);
    if (!given && profiles == nullptr) {
      if (draft_.scene.loop.control.limiter.law == Law::kNone || !draft_.scene.exerts_force()) return 0;
      blame(full, {},
            "missing, expected " + kZeroOrMore.expected(unit) +
                (draft_.scene.moves_a_hand() ? ": what tendon-identify finds of this very device, or 0"
                                             : ", because there is no profile"));
    }
    const double bound = given ? *given : profiles->value * axis_share;
    const double most = truth * axis_share;
    if (bound > most && !draft_.scene.moves_a_hand() && draft_.scene.exerts_force()) {
      blame(full, {full, "device.effects." + key},
            "expected at most " + with_symbol(digits(most), unit) + ", the true friction of the simulated device" +
                (axis_share < 1 ? " (an axis by itself has 1/√3 of it)" : "") +
                ", because a higher bound voids the limiter's proof, found " + digits(bound) +
                (given ? "" : " (the profile's)"));
    }
    return bound;
  }

  Draft draft_;
  const toml::table& file_;
  const std::string& name_;
};

toml::table parse_toml(std::string_view text, const std::string& name) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    throw SceneError(name + ':' + std::to_string(error.source().begin.line) +
                     ": not TOML: " + std::string(error.description()));
  }
}

/// "TABLE.KEY=VALUE" → the table's key has that value; "TABLE.KEY=" → it is not there.
void apply_setting(toml::table& file, const std::string& setting) {
  const auto refuse = [&setting](const std::string& why) {
    throw SceneError("setting " + in_quotes(setting) + ": " + why);
  };
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0) refuse("expected TABLE.KEY=VALUE");
  std::string_view path = std::string_view(setting).substr(0, equals);
  const std::string value = setting.substr(equals + 1);

  toml::table* table = &file;
  for (std::size_t dot = path.find('.'); dot != std::string_view::npos; dot = path.find('.')) {
    const std::string_view name = path.substr(0, dot);
    path.remove_prefix(dot + 1);
    if (!table->contains(name)) {
      if (value.empty()) return;
      table->insert(name, toml::table{});
    }
    table = table->get_as<toml::table>(name);
    if (table == nullptr) refuse(in_quotes(name) + " is not a table");
  }
  if (value.empty()) {
    table->erase(path);
    return;
  }
  try {
    const toml::table parsed = toml::parse("value = " + value);
    table->insert_or_assign(path, *parsed.get("value"));
  } catch (const toml::parse_error&) {
    table->insert_or_assign(path, value);
  }
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory,
                  std::span<const std::string> settings) {
  if (text.size() > kMaxSceneBytes) {
    throw SceneError(name + ": expected a scene of at most " + std::to_string(kMaxSceneBytes) + " bytes, found more");
  }
  toml::table file = parse_toml(text, name);
  for (const std::string& setting : settings) apply_setting(file, setting);
  Draft draft;
  draft.scene.text = text;
  draft.scene.has_network = file.contains("network");
  draft.scene.name = label_of(std::filesystem::path(name).stem().string());
  Findings findings;
  Reader reader(findings, &file, "", {});
  declare_scene(reader, draft);
  reader.refuse_unknown();
  findings.throw_first(name);
  return Settlement(std::move(draft), file, name).scene(directory);
}

Scene read_scene(const std::filesystem::path& file) {
  struct Close {
    void operator()(std::FILE* stream) const { std::fclose(stream); }
  };
  const auto fail = [&file] {
    throw SceneError("cannot read " + file.string() + ": " + std::generic_category().message(errno));
  };
  const std::unique_ptr<std::FILE, Close> stream(std::fopen(file.c_str(), "rbe"));
  if (!stream) fail();
  std::string text(kMaxSceneBytes + 1, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), stream.get()));
  if (std::ferror(stream.get()) != 0) fail();
  return parse_scene(text, file.string(), file.parent_path());
}

std::vector<Scene> read_scenes(const std::vector<std::filesystem::path>& files) {
  std::vector<Scene> scenes;
  for (const std::filesystem::path& file : files) {
    Scene scene = read_scene(file);
    scene.loop.device = static_cast<std::uint32_t>(scenes.size());
    for (const Scene& before : scenes) {
      if (scene.name != before.name) continue;
      throw SceneError(file.string() + ": device.name: expected a name of its own, found " + in_quotes(scene.name) +
                       " again");
    }
    for (const auto& [name, there] :
         {std::pair("network", scene.has_network), std::pair("recording", scene.recording.has_value())}) {
      if (!there || scenes.empty()) continue;
      throw SceneError(file.string() + ": " + name + ": expected in the first scene only, " + files.front().string());
    }
    scenes.push_back(std::move(scene));
  }
  return scenes;
}

std::string scene_reference() {
  std::string text;
  Draft draft;
  Reference reference(text);
  declare_scene(reference, draft);
  return text;
}

}  // namespace tendon
