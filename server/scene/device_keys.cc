// SPDX-License-Identifier: Apache-2.0
#include <toml++/toml.h>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

#include "core/base/frames.h"
#include "devices/simulated/profiles.h"
#include "server/scene/keys.h"
#include "server/scene/parts.h"
#include "server/scene/reader.h"
#include "server/scene/reference.h"
#include "server/scene/values.h"

namespace tendon::scene_file {
namespace {

/// The USB port of a device, as named by the kernel.
struct UsbPort {
  static std::string expected(const Unit&) { return "a port as `tendond devices` names it, like \"1-2.3\""; }

  static Verdict take(const toml::node& node, const Unit& unit, std::string& to) {
    constexpr std::size_t kLongestPort = 32;  // there are at most 7 tiers of hubs
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

/// A Haptikfabriken device with published kinematics.
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

/// The resolution of the force sensor, if there is one.
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

struct Axes {
  static std::string expected(const Unit&) {
    return "the axes that point to the operator's right, up and towards the user, like \"right=x up=y user=z\"";
  }

  static Verdict take(const toml::node& node, const Unit& unit, std::string& to) {
    const auto* text = node.as_string();
    if (text == nullptr) return Refusal{&node, expected(unit)};
    try {
      to = axes_in_words(operator_from_device(**text));
    } catch (const std::invalid_argument& error) {
      const std::string_view why = error.what();
      return Refusal{&node, expected(unit) + " (" + std::string(why.substr(why.rfind(": ") + 2)) + ")"};
    }
    return {};
  }

  static std::string shown(const Unit&, const std::string& value) { return in_quotes(value); }
};

/// A scalar that is stored as the x coordinate of a point. This is used for the opening of a gripper.
struct AlongX {
  static std::string expected(const Unit& unit) { return kAnyNumber.expected(unit); }

  static Verdict take(const toml::node& node, const Unit& unit, Vec3& to) {
    to.setZero();
    return kAnyNumber.take(node, unit, to.x());
  }

  static std::string shown(const Unit& unit, const Vec3& value) { return Number::shown(unit, value.x()); }
};

struct MotionNames {
  std::string_view amplitude, centre, from, to, points, scale, origin;
};
constexpr MotionNames kInMm = {"amplitude_mm", "centre_mm", "from_mm", "to_mm", "points_mm", "scale_m", "origin_mm"};
constexpr MotionNames kInDegrees = {"amplitude_deg", "centre_deg", "from_deg",  "to_deg",
                                    "points_deg",    "scale_deg",  "origin_deg"};

enum class MechanismKind : std::uint8_t { kFalcon, kArm };
constexpr std::size_t kMostPresses = 32;
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

template <class Table>
void declare_joint_friction(Table& friction, Draft& draft, JointFriction::Config& config) {
  const Names<MechanismKind> kinds{{{"falcon", MechanismKind::kFalcon}, {"arm", MechanismKind::kArm}}};
  friction.kind(kinds, [&](Table& keys, MechanismKind kind) {
    if (kind == MechanismKind::kArm) {
      auto& arm = config.mechanism.emplace<Mechanism::Arm>();
      keys.key("upper_arm_mm", arm.upper_arm, Number{.least = 10, .most = 1e4},
               "shoulder to elbow, of an arm like a Phantom's", kRequired);
      keys.key("forearm_mm", arm.forearm, Number{.least = 10, .most = 1e4}, "elbow to handle", kRequired);
    }
    keys.key("coulomb_n_m", draft.joint_coulomb, Vector{}, "Coulomb friction of each joint, in place of the handle's",
             Absent{.text = "enough that coulomb_friction_n is the least friction at any place and in any direction"});
    keys.key("viscous_n_m_s", config.viscous, Vector{}, "viscous friction of each joint, besides the handle's");
    keys.key("centre_mm", config.centre, Vector{}, "where the middle of the mechanism's workspace lies");
  });
}

template <class Table>
void declare_effects(Table& effects, Draft& draft) {
  const DeviceProfile* const profile = draft.profile;
  SimulatedDevice::Config& device = draft.simulated;
  constexpr OrFalse kDelay{Number{.least = 0, .most = 100, .without_least = true}};
  constexpr OrFalse kEffect{kAboveZero};
  constexpr Absent kProfiles{.text = "the profile's; without a profile there is no such effect"};
  effects.key("mass_kg", device.mass, kAboveZero, "apparent mass at the handle",
              Absent{.required = profile == nullptr, .text = "the profile's; required without a profile"});
  effects.key({"viscous_friction_n_s_per_m", "true viscous friction"}, device.viscous_friction, kEffect,
              "true viscous friction", kProfiles);
  effects.key({"coulomb_friction_n", "true Coulomb friction"}, device.coulomb_friction, kEffect,
              "true Coulomb friction", kProfiles);
  effects.key({"encoder_step_um", "positions in counts"}, device.encoder_step, kEffect,
              "one encoder count, on each axis", kProfiles);
  effects.key({"max_force_n", "the device's own saturation"}, device.max_force, kEffect,
              "the device clamps the force vector to this length", kProfiles);
  effects.key({"amplifier_bandwidth_hz", "motors that lag behind the command"}, device.amplifier_bandwidth, kEffect,
              "the motors follow the command with this bandwidth (-3 dB, first order)", kProfiles);
  effects.key({"force_sensor", "measures the hand's force; admittance needs it"}, device.force_sensor, Sensor{},
              "measures the force of the hand: what a device of admittance type has", kProfiles);
  effects.key({"watchdog_ms", "lets go when no command comes"}, device.watchdog, kEffect,
              "the device drops the force when it gets no command for this long", kProfiles);
  effects.key({"sample_delay_ms", "positions come late"}, device.sample_delay, kDelay,
              "positions arrive this much later, with the time at which they were taken");
  effects.key({"force_delay_ms", "forces reach the motors late"}, device.force_delay, kDelay,
              "forces reach the motors this much later");
  effects.part(
      {"joint_friction", "friction of each joint, by the pose"}, device.joint_friction,
      [&draft](Table& friction, JointFriction::Config& config) { declare_joint_friction(friction, draft, config); });
  effects.part({"structural_mode", "the handle on a spring"}, device.structural_mode,
               [](Table& keys, SimulatedDevice::Config::StructuralMode& mode) {
                 keys.key("handle_mass_kg", mode.handle_mass, kAboveZero,
                          "the part of mass_kg on the hand's side of the spring", kRequired);
                 keys.key("stiffness_n_per_m", mode.stiffness, kAboveZero, "of the spring between motors and handle",
                          kRequired);
                 keys.key("damping_n_s_per_m", mode.damping, kZeroOrMore, "of the damper beside the spring");
               });
  effects.tables("output", device.outputs, kMostOutputs, [](Table& outputs, OutputDescription& output) {
    outputs.key("name", output.name, Label{}, "for people", kRequired);
    outputs.key("kind", output.kind,
                Names<OutputKind>{{{"lamp", OutputKind::kLamp}, {"vibration", OutputKind::kVibration}}},
                "what the clients that hold the device may set; a simulated device only remembers it", kRequired);
  });
}

template <class Table>
void declare_environment(Table& keys, SimulatedEnvironment::Config& environment) {
  keys.key("damping_n_s_per_m", environment.damping, kZeroOrMore, "of the medium that the handle moves in");
  keys.key("friction_n", environment.friction, kZeroOrMore, "Coulomb friction of the medium");
  keys.tables("wall", environment.walls, SimulatedEnvironment::kMostWalls,
              [](Table& walls, SimulatedEnvironment::Wall& wall) {
                walls.key("point_mm", wall.point, Vector{}, "any point of its surface");
                walls.key("normal", wall.normal, Vector{}, "out of the wall; its length does not count", kRequired);
                walls.key("stiffness_n_per_m", wall.stiffness, kAboveZero, "force for each depth", kRequired);
                walls.key("damping_n_s_per_m", wall.damping, kZeroOrMore, "while the handle goes in");
                walls.key("friction", wall.friction, kZeroOrMore, "Coulomb's coefficient along the surface");
                walls.key("speed_m_per_s", wall.speed, kAnyNumber, "along the normal: above 0 it comes nearer");
                walls.key("from_ms", wall.from, kZeroOrMore, "it is there, and begins to move, after this time");
                walls.key("until_ms", wall.until, kAboveZero, "it is gone after this time", Absent{.text = "never"});
              });
}

template <class Point = Vector, class Table>
void declare_csv(Table& keys, RecordedMotionFile& file, const MotionNames& names = kInMm) {
  keys.key("file", file.path, Path{}, "CSV file, relative to the scene file", kRequired);
  keys.key("time_column", file.time, Column{}, "time in s, unless its name says another unit: t_ms");
  keys.key("position_column", file.position, Column{}, "position along a line, or turn about an axis", kRequired);
  keys.key(names.scale, file.scale, kAnyNumber, "how much one unit of the position is; negative turns it round",
           Absent{.text = "1 m or 1 rad"});
  keys.key(names.origin, file.origin, Point{}, "where position 0 lies");
  if constexpr (std::is_same_v<Point, Vector>) {
    keys.key("direction", file.direction, Vector{}, "of the line or the axis; its length does not count");
  }
}

/// Declares a motion of a point in mm, of a rotation vector in degrees, or of the opening of a gripper in degrees.
template <class Point = Vector, class Table>
void declare_motion(Table& motion, DraftMotion& draft, const MotionNames& names = kInMm) {
  motion.kind(motion_names(), [&draft, &names](Table& keys, MotionKind kind) {
    switch (kind) {
      case MotionKind::kSine: {
        auto& sine = std::get<ScriptedMotion::Sine>(draft.script = ScriptedMotion::Sine{});
        keys.key(names.amplitude, sine.amplitude, kZeroOrMore, "to either side of the centre", kRequired);
        keys.key("frequency_hz", sine.frequency, kZeroOrMore, "cycles per second", kRequired);
        keys.key(names.centre, sine.centre, Point{}, "where it starts");
        if constexpr (std::is_same_v<Point, Vector>) {
          keys.key("direction", sine.direction, Vector{}, "where it moves first; its length does not count");
        }
        return;
      }
      case MotionKind::kRampHold: {
        auto& ramp = std::get<ScriptedMotion::RampHold>(draft.script = ScriptedMotion::RampHold{});
        keys.key(names.from, ramp.from, Point{}, "where it starts", kRequired);
        keys.key(names.to, ramp.to, Point{}, "where it goes at constant speed", kRequired);
        keys.key("ramp_ms", ramp.ramp, kAboveZero, "how long the way takes", kRequired);
        keys.key("hold_ms", ramp.hold, kZeroOrMore, "how long it rests at either end, going to and fro for ever",
                 Absent{.text = "it goes once and stays"});
        return;
      }
      case MotionKind::kMinimumJerk: {
        auto& reach = std::get<ScriptedMotion::MinimumJerk>(draft.script = ScriptedMotion::MinimumJerk{});
        keys.key(names.points, reach.points, ListOf<Point>{}, "2 or more points; the hand rests at each", kRequired);
        keys.key("durations_ms", reach.durations, ListOf<Number>{kAboveZero}, "the time from each point to the next",
                 kRequired);
        keys.key("back_and_forth", reach.back_and_forth, YesNo{},
                 "goes to and fro for ever, instead of staying at the last point");
        return;
      }
      case MotionKind::kRecorded: {
        auto& file = draft.recorded.emplace();
        declare_csv<Point>(keys, file, names);
        keys.key("at_end", file.at_end, at_end_names(), "stay at the last sample, or start again");
        return;
      }
    }
  });
}

template <class Table>
void declare_rotation(Table& keys, Draft& draft, SimulatedRotation::Config& config) {
  keys.key("inertia_kg_m2", config.inertia, kAboveZero, "of the handle, the same about every axis", kRequired);
  keys.key("viscous_friction_nm_s_per_rad", config.viscous_friction, kAboveZero, "true viscous friction");
  keys.key("coulomb_friction_nm", config.coulomb_friction, kAboveZero, "true Coulomb friction");
  keys.key("max_torque_nm", config.max_torque, kAboveZero,
           "the motors give no longer torque; force and torque are shortened by one share",
           Absent{.text = "it has no motors that turn"});
  keys.key("encoder_step_rad", config.encoder_step, kAboveZero, "one encoder count, on each axis");
  keys.key("start_deg", config.start, Vector{}, "rotation vector: the handle is turned about this axis by its length",
           Absent{.text = "how the hand starts, or not turned"});
  keys.part("hand", config.hand, [&draft](Table& hand, SimulatedRotation::Hand& grip) {
    hand.key("stiffness_nm_per_rad", grip.stiffness, kAboveZero, "of the grip, against turning", kRequired);
    hand.key("damping_nm_s_per_rad", grip.damping, kZeroOrMore, "of the grip, against turning");
    hand.table("motion", [&draft](Table& motion) { declare_motion(motion, draft.turning, kInDegrees); });
  });
}

template <class Table>
void declare_gripper(Table& keys, Draft& draft, SimulatedGripper::Config& config) {
  keys.key("open_deg", config.open, Number{.least = 0, .most = 180, .without_least = true}, "its largest opening",
           kRequired);
  keys.key("arm_mm_per_rad", config.arm, kAboveZero, "travel of the fingers on each other", kRequired);
  keys.key("mass_kg", config.mass, kAboveZero, "effective mass of the fingers", kRequired);
  keys.key("viscous_friction_n_s_per_m", config.viscous_friction, kAboveZero, "true viscous friction, at the fingers");
  keys.key("coulomb_friction_n", config.coulomb_friction, kAboveZero, "true Coulomb friction, at the fingers");
  keys.key("max_force_n", config.max_force, kAboveZero, "the motor gives no larger force on the fingers",
           Absent{.text = "it has no motor"});
  keys.key("encoder_step_rad", config.encoder_step, kAboveZero, "one encoder count of the opening");
  keys.key("start_deg", config.start, kZeroOrMore, "how far it is open",
           Absent{.text = "how the hand starts, or closed"});
  keys.part("hand", config.hand, [&draft](Table& hand, SimulatedGripper::Hand& grip) {
    hand.key("stiffness_n_per_m", grip.stiffness, kAboveZero, "of the fingers that hold it", kRequired);
    hand.key("damping_n_s_per_m", grip.damping, kZeroOrMore, "of the fingers that hold it");
    hand.table("motion", [&draft](Table& motion) { declare_motion<AlongX>(motion, draft.gripping, kInDegrees); });
  });
}

template <class Table>
void declare_hand(Table& keys, Draft& draft, OperatorHand::Config& hand) {
  keys.key("profile", draft.operator_profile, operator_names(),
           "what holds the handle, with the middle of the published numbers; each key below overrides one");
  const OperatorProfile* const profile = draft.operator_profile;
  if (profile != nullptr) hand = profile->hand(std::move(hand.motion));
  constexpr Absent kProfiles{.text = "the profile's; 0 without a profile"};
  keys.key("stiffness_n_per_m", hand.stiffness, kAboveZero, "of the grip",
           Absent{.required = profile == nullptr, .text = "the profile's; required without a profile"});
  keys.key("damping_n_s_per_m", hand.damping, kZeroOrMore, "of the grip", kProfiles);
  keys.key("mass_kg", hand.mass, kZeroOrMore, "moves with the handle", kProfiles);
  keys.key("lets_go_after_ms", draft.simulated.lets_go_after, kZeroOrMore,
           "after this time it lets go of the handle, for good", Absent{.text = "never"});
  keys.key("button_after_ms", draft.simulated.button_after, kZeroOrMore,
           "after this time it presses button 0, and holds it", Absent{.text = "never"});
  keys.tables("press", draft.simulated.presses, kMostPresses,
              [](Table& presses, SimulatedDevice::Config::Press& press) {
                presses.key("button", press.button, Count{31}, "which button it presses");
                presses.key("from_ms", press.from, kZeroOrMore, "when it presses it", kRequired);
                presses.key("for_ms", press.length, kAboveZero, "how long it holds it", kRequired);
              });
  keys.table("motion", [&draft](Table& motion) { declare_motion(motion, draft.motion); });
}

template <class Table>
void declare_port(Table& keys, std::string& port) {
  keys.key("port", port, UsbPort{}, "where it is plugged in, when there are several",
           Absent{.text = "the first that nobody uses"});
}

// The keys of each kind of device.

template <class Table>
void declare(Table& keys, SimulatedDevice::Config& /*device*/, Draft& draft) {
  SimulatedDevice::Config& config = draft.simulated;
  keys.key("profile", draft.profile, profile_names(), "the effects of a real device; each key below overrides one");
  if (draft.profile != nullptr) config = draft.profile->device();
  keys.key(
      "substep_us", config.max_substep, Number{.least = 10, .most = 4000},
      "the longest step of the simulation: longer ones cost less, and are as right where nothing stiff is simulated");
  keys.key("start_position_mm", config.start_position, Vector{}, "of the handle",
           Absent{.text = "where the hand starts, or the origin"});
  keys.table("effects", [&draft](Table& effects) { declare_effects(effects, draft); });
  keys.part({"hand", "the operator: a spring, a damper and a mass"}, config.hand,
            [&draft](Table& hand, OperatorHand::Config& part) { declare_hand(hand, draft, part); });
  keys.part({"environment", "walls and a medium that the handle runs into"}, config.environment,
            [](Table& environment, SimulatedEnvironment::Config& part) { declare_environment(environment, part); });
  keys.part({"rotation", "the handle turns, in the operator's hand"}, config.rotation,
            [&draft](Table& rotation, SimulatedRotation::Config& part) { declare_rotation(rotation, draft, part); });
  keys.part({"gripper", "two fingers that open and close"}, config.gripper,
            [&draft](Table& gripper, SimulatedGripper::Config& part) { declare_gripper(gripper, draft, part); });
}

template <class Table>
void declare(Table& keys, falcon::Config& device, Draft& /*draft*/) {
  declare_port(keys, device.port);
  keys.key("firmware", device.firmware, Path{},
           "the file of your own Novint software, relative to this file; --falcon-firmware overrides it",
           Absent{.text = "none; only a device that has its firmware already can be used"});
  keys.key("accept_unknown_firmware", device.accept_unknown_firmware, YesNo{},
           "accepts even a file that is not among the known ones");
}

template <class Table>
void declare(Table& keys, ReplayDevice::Config& device, Draft& draft) {
  keys.key("recording", draft.replayed, Path{},
           "MCAP recording of tendond, relative to this file: the hand of its (first) device",
           Absent{.text = "none; then there is a table csv"});
  keys.key("at_end", device.at_end, at_end_names(), "stay at the last sample, or start again");
  keys.key("encoder_step_um", device.position_resolution, kZeroOrMore,
           "one encoder count of the device that was recorded; 0: its positions were exact");
  keys.part("csv", draft.csv, [](Table& csv, RecordedMotionFile& file) { declare_csv(csv, file); });
}

template <class Table>
void declare(Table& keys, spacemouse::Config& device, Draft& /*draft*/) {
  declare_port(keys, device.port);
  keys.key("speed_m_per_s", device.motion.speed, kAboveZero, "of the position, with the cap at its stop");
  keys.key("dead_band", device.motion.dead_band, Number{.least = 0, .most = 0.9},
           "share of the way to the stop in which nothing moves");
  keys.key("reach_mm", device.motion.reach, kAboveZero,
           "the position stays within this distance of the origin, on each axis");
  keys.key("turn_speed_deg_per_s", device.motion.turn_speed, kAboveZero,
           "of the turn, with the cap twisted to its stop");
}

template <class Table>
void declare(Table& keys, woodenhaptics::Config& device, Draft& /*draft*/) {
  declare_port(keys, device.port);
  keys.key("model", device.drive.model, ArmModel{}, "which arm it is", kRequired);
  keys.key("max_current_ma", device.drive.max_current, Number{.least = 1, .most = 6000},
           "of each motor; at most the full scale of the amplifiers");
}

/// Creates the alternative with this index and declares its keys.
template <std::size_t index = 0, class Table>
void declare_kind(std::size_t kind, Table& keys, Draft& draft) {
  if constexpr (index < std::variant_size_v<Scene::AnyDevice>) {
    if (kind != index) return declare_kind<index + 1>(kind, keys, draft);
    declare(keys, draft.scene.device.emplace<index>(), draft);
  }
}

}  // namespace

template <class Table>
void declare_device(Table& device, Draft& draft) {
  Names<std::size_t> kinds;
  for (const Driver* driver : drivers()) kinds.all.emplace_back(driver->kind, kinds.all.size());
  const auto common = [&draft](Table& keys) {
    keys.key("name", draft.scene.name, Label{}, "the name by which clients ask for this device, of several",
             Absent{.text = "the name of the scene file"});
    keys.key("count", draft.scene.count, Count{kMostDevices, 1},
             "for \"simulated\": so many devices, all alike, named NAME-0, NAME-1 … A session has devices of one bank "
             "of 16: NAME-0 to NAME-15, NAME-16 to NAME-31 …");
    keys.key("axes", draft.scene.axes, Axes{},
             "how its base frame lies before the operator; programs turn positions by it",
             Absent{.text = "the driver's; of a recorded hand it is not known"});
    keys.key("group", draft.scene.group, Label{}, "devices of one body, as two arms or five fingers, have the same",
             Absent{.text = "it is by itself"});
    keys.key("held_by", draft.scene.hand,
             Names<Hand>{{{"any", Hand::kAny}, {"left", Hand::kLeft}, {"right", Hand::kRight}}},
             "the hand of the operator that holds it");
  };
  device.kind(
      kinds, [&draft](Table& keys, std::size_t kind) { declare_kind(kind, keys, draft); }, common);
}

template void declare_device(Reader&, Draft&);
template void declare_device(Reference&, Draft&);
template void declare_device(Parts&, Draft&);

}  // namespace tendon::scene_file
