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

struct UsbPort {
  static std::string expected(const Unit&) { return "a port from `tendond devices`, like \"1-2.3\""; }

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

/// Excludes devices without published kinematics.
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
    return Refusal{
        &node, expected(unit) +
                   (closed ? " (Polhem v2 and v3 have a closed linkage, and their kinematics are not published)" : "")};
  }

  static std::string shown(const Unit&, const woodenhaptics::Model* model) {
    return model != nullptr ? in_quotes(model->name) : "none";
  }
};

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

/// The x coordinate of a point, for the opening of a gripper.
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
               "Length from the shoulder to the elbow of an arm like a Phantom", kRequired);
      keys.key("forearm_mm", arm.forearm, Number{.least = 10, .most = 1e4}, "Length from the elbow to the handle",
               kRequired);
    }
    keys.key(
        "coulomb_n_m", draft.joint_coulomb, Vector{},
        "Coulomb friction of each joint, which replaces that of the handle",
        Absent{.text =
                   "computed so that coulomb_friction_n is the minimum friction over all positions and directions"});
    keys.key("viscous_n_m_s", config.viscous, Vector{},
             "Viscous friction of each joint, in addition to that of the handle");
    keys.key("centre_mm", config.centre, Vector{}, "Centre of the mechanism's workspace");
  });
}

template <class Table>
void declare_effects(Table& effects, Draft& draft) {
  const DeviceProfile* const profile = draft.profile;
  SimulatedDevice::Config& device = draft.simulated;
  constexpr OrFalse kDelay{Number{.least = 0, .most = 100, .without_least = true}};
  constexpr OrFalse kEffect{kAboveZero};
  constexpr Absent kProfiles{.text = "that of the profile; without a profile, this effect is off"};
  effects.key("mass_kg", device.mass, kAboveZero, "Apparent mass at the handle",
              Absent{.required = profile == nullptr, .text = "that of the profile; required without a profile"});
  effects.key({"viscous_friction_n_s_per_m", "true viscous friction"}, device.viscous_friction, kEffect,
              "True viscous friction", kProfiles);
  effects.key({"coulomb_friction_n", "true Coulomb friction"}, device.coulomb_friction, kEffect,
              "True Coulomb friction", kProfiles);
  effects.key({"encoder_step_um", "rounds positions to encoder counts"}, device.encoder_step, kEffect,
              "One encoder count on each axis", kProfiles);
  effects.key({"max_force_n", "limits the force of the motors"}, device.max_force, kEffect,
              "Maximum force of the motors. The device reduces the length of the force vector to it", kProfiles);
  effects.key({"amplifier_bandwidth_hz", "makes the motors lag behind the command"}, device.amplifier_bandwidth,
              kEffect, "Bandwidth with which the motors follow the command (-3 dB, first order)", kProfiles);
  effects.key({"force_sensor", "measures the force of the hand, for admittance control"}, device.force_sensor, Sensor{},
              "Resolution of a force sensor at the handle, as in an admittance-type device", kProfiles);
  effects.key({"watchdog_ms", "removes the force if no command arrives"}, device.watchdog, kEffect,
              "Time without a command after which the device removes the force", kProfiles);
  effects.key({"sample_delay_ms", "delays the positions"}, device.sample_delay, kDelay,
              "Delay of the positions. Their timestamps are not changed");
  effects.key({"force_delay_ms", "delays the forces"}, device.force_delay, kDelay,
              "Delay of the forces on the way to the motors");
  effects.part(
      {"joint_friction", "computes the friction in each joint"}, device.joint_friction,
      [&draft](Table& friction, JointFriction::Config& config) { declare_joint_friction(friction, draft, config); });
  effects.part({"structural_mode", "connects handle and motors by a spring"}, device.structural_mode,
               [](Table& keys, SimulatedDevice::Config::StructuralMode& mode) {
                 keys.key("handle_mass_kg", mode.handle_mass, kAboveZero,
                          "Part of mass_kg on the hand's side of the spring", kRequired);
                 keys.key("stiffness_n_per_m", mode.stiffness, kAboveZero,
                          "Stiffness of the spring between motors and handle", kRequired);
                 keys.key("damping_n_s_per_m", mode.damping, kZeroOrMore, "Damping between motors and handle");
               });
  effects.tables("output", device.outputs, kMostOutputs, [](Table& outputs, OutputDescription& output) {
    outputs.key("name", output.name, Label{}, "Name of the output, for users", kRequired);
    outputs.key(
        "kind", output.kind, Names<OutputKind>{{{"lamp", OutputKind::kLamp}, {"vibration", OutputKind::kVibration}}},
        "Kind of output that a controlling client can set. A simulated device only stores the value", kRequired);
  });
}

template <class Table>
void declare_environment(Table& keys, SimulatedEnvironment::Config& environment) {
  keys.key("damping_n_s_per_m", environment.damping, kZeroOrMore, "Damping of the medium in which the handle moves");
  keys.key("friction_n", environment.friction, kZeroOrMore, "Coulomb friction of the medium");
  keys.tables(
      "wall", environment.walls, SimulatedEnvironment::kMostWalls, [](Table& walls, SimulatedEnvironment::Wall& wall) {
        walls.key("point_mm", wall.point, Vector{}, "Any point on the surface");
        walls.key("normal", wall.normal, Vector{}, "Direction out of the wall, of any length", kRequired);
        walls.key("stiffness_n_per_m", wall.stiffness, kAboveZero, "Stiffness of the wall", kRequired);
        walls.key("damping_n_s_per_m", wall.damping, kZeroOrMore, "Damping while the handle moves into the wall");
        walls.key("friction", wall.friction, kZeroOrMore, "Coefficient of friction along the surface");
        walls.key("speed_m_per_s", wall.speed, kAnyNumber,
                  "Speed of the wall along its normal. Positive: towards the handle");
        walls.key("from_ms", wall.from, kZeroOrMore, "Time at which the wall appears and starts to move");
        walls.key("until_ms", wall.until, kAboveZero, "Time at which the wall disappears", Absent{.text = "never"});
      });
}

template <class Point = Vector, class Table>
void declare_csv(Table& keys, RecordedMotionFile& file, const MotionNames& names = kInMm) {
  keys.key("file", file.path, Path{}, "CSV file, relative to the scene file", kRequired);
  keys.key("time_column", file.time, Column{},
           "Column with the time in s, or in the unit of its name, for example t_ms");
  keys.key("position_column", file.position, Column{},
           "Column with the position along a line, or with the angle about an axis", kRequired);
  keys.key(names.scale, file.scale, kAnyNumber, "Size of one unit of the position. Negative: the direction is reversed",
           Absent{.text = "1 m or 1 rad"});
  keys.key(names.origin, file.origin, Point{}, "Place of position 0");
  if constexpr (std::is_same_v<Point, Vector>) {
    keys.key("direction", file.direction, Vector{}, "Direction of the line or the axis, of any length");
  }
}

/// Declares a motion of a point in mm, of a rotation vector in degrees, or of the opening of a gripper in degrees.
template <class Point = Vector, class Table>
void declare_motion(Table& motion, DraftMotion& draft, const MotionNames& names = kInMm) {
  motion.kind(motion_names(), [&draft, &names](Table& keys, MotionKind kind) {
    switch (kind) {
      case MotionKind::kSine: {
        auto& sine = std::get<ScriptedMotion::Sine>(draft.script = ScriptedMotion::Sine{});
        keys.key(names.amplitude, sine.amplitude, kZeroOrMore, "Amplitude to each side of the centre", kRequired);
        keys.key("frequency_hz", sine.frequency, kZeroOrMore, "Frequency of the motion", kRequired);
        keys.key(names.centre, sine.centre, Point{}, "Centre of the motion, where it starts");
        if constexpr (std::is_same_v<Point, Vector>) {
          keys.key("direction", sine.direction, Vector{}, "Direction of the first motion, of any length");
        }
        return;
      }
      case MotionKind::kRampHold: {
        auto& ramp = std::get<ScriptedMotion::RampHold>(draft.script = ScriptedMotion::RampHold{});
        keys.key(names.from, ramp.from, Point{}, "Start of the motion", kRequired);
        keys.key(names.to, ramp.to, Point{}, "End of the motion, which is reached at constant speed", kRequired);
        keys.key("ramp_ms", ramp.ramp, kAboveZero, "Duration of the motion", kRequired);
        keys.key("hold_ms", ramp.hold, kZeroOrMore, "Time at rest at each end of a repeated back-and-forth motion",
                 Absent{.text = "one motion, without return"});
        return;
      }
      case MotionKind::kMinimumJerk: {
        auto& reach = std::get<ScriptedMotion::MinimumJerk>(draft.script = ScriptedMotion::MinimumJerk{});
        keys.key(names.points, reach.points, ListOf<Point>{}, "2 or more points, at which the hand comes to rest",
                 kRequired);
        keys.key("durations_ms", reach.durations, ListOf<Number>{kAboveZero},
                 "Duration of the motion from each point to the next", kRequired);
        keys.key("back_and_forth", reach.back_and_forth, YesNo{},
                 "Repeat the motion back and forth instead of staying at the last point");
        return;
      }
      case MotionKind::kRecorded: {
        auto& file = draft.recorded.emplace();
        declare_csv<Point>(keys, file, names);
        keys.key("at_end", file.at_end, at_end_names(),
                 "What happens after the last sample: hold its position, or repeat the motion from the start");
        return;
      }
    }
  });
}

template <class Table>
void declare_rotation(Table& keys, Draft& draft, SimulatedRotation::Config& config) {
  keys.key("inertia_kg_m2", config.inertia, kAboveZero, "Moment of inertia of the handle, the same about every axis",
           kRequired);
  keys.key("viscous_friction_nm_s_per_rad", config.viscous_friction, kAboveZero, "True viscous friction");
  keys.key("coulomb_friction_nm", config.coulomb_friction, kAboveZero, "True Coulomb friction");
  keys.key("max_torque_nm", config.max_torque, kAboveZero,
           "Maximum torque of the motors. If it is exceeded, force and torque are reduced by the same factor",
           Absent{.text = "no motors that turn the handle"});
  keys.key("encoder_step_rad", config.encoder_step, kAboveZero, "One encoder count on each axis");
  keys.key("start_deg", config.start, Vector{},
           "Initial orientation, as a rotation vector: the direction is the axis, the length is the angle",
           Absent{.text = "the start of the hand's motion, or 0"});
  keys.part("hand", config.hand, [&draft](Table& hand, SimulatedRotation::Hand& grip) {
    hand.key("stiffness_nm_per_rad", grip.stiffness, kAboveZero, "Angular stiffness of the grip", kRequired);
    hand.key("damping_nm_s_per_rad", grip.damping, kZeroOrMore, "Angular damping of the grip");
    hand.table("motion", [&draft](Table& motion) { declare_motion(motion, draft.turning, kInDegrees); });
  });
}

template <class Table>
void declare_gripper(Table& keys, Draft& draft, SimulatedGripper::Config& config) {
  keys.key("open_deg", config.open, Number{.least = 0, .most = 180, .without_least = true}, "Maximum opening",
           kRequired);
  keys.key("arm_mm_per_rad", config.arm, kAboveZero,
           "Travel of the fingers towards each other for each radian of the opening", kRequired);
  keys.key("mass_kg", config.mass, kAboveZero, "Effective mass of the fingers", kRequired);
  keys.key("viscous_friction_n_s_per_m", config.viscous_friction, kAboveZero, "True viscous friction, at the fingers");
  keys.key("coulomb_friction_n", config.coulomb_friction, kAboveZero, "True Coulomb friction, at the fingers");
  keys.key("max_force_n", config.max_force, kAboveZero, "Maximum force of the motor on the fingers",
           Absent{.text = "no motor"});
  keys.key("encoder_step_rad", config.encoder_step, kAboveZero, "One encoder count of the opening");
  keys.key("start_deg", config.start, kZeroOrMore, "Initial opening",
           Absent{.text = "the start of the hand's motion, or 0"});
  keys.part("hand", config.hand, [&draft](Table& hand, SimulatedGripper::Hand& grip) {
    hand.key("stiffness_n_per_m", grip.stiffness, kAboveZero, "Stiffness of the operator's fingers", kRequired);
    hand.key("damping_n_s_per_m", grip.damping, kZeroOrMore, "Damping of the operator's fingers");
    hand.table("motion", [&draft](Table& motion) { declare_motion<AlongX>(motion, draft.gripping, kInDegrees); });
  });
}

template <class Table>
void declare_hand(Table& keys, Draft& draft, OperatorHand::Config& hand) {
  keys.key(
      "profile", draft.operator_profile, operator_names(),
      "Model of the hand or arm, with the middle of the published ranges. Each key below overrides one of its values");
  const OperatorProfile* const profile = draft.operator_profile;
  if (profile != nullptr) hand = profile->hand(std::move(hand.motion));
  constexpr Absent kProfiles{.text = "that of the profile; 0 without a profile"};
  keys.key("stiffness_n_per_m", hand.stiffness, kAboveZero, "Stiffness of the grip",
           Absent{.required = profile == nullptr, .text = "that of the profile; required without a profile"});
  keys.key("damping_n_s_per_m", hand.damping, kZeroOrMore, "Damping of the grip", kProfiles);
  keys.key("mass_kg", hand.mass, kZeroOrMore, "Mass of the hand, which moves with the handle", kProfiles);
  keys.key("lets_go_after_ms", draft.simulated.lets_go_after, kZeroOrMore,
           "Time at which the hand releases the handle permanently", Absent{.text = "never"});
  keys.key("button_after_ms", draft.simulated.button_after, kZeroOrMore,
           "Time at which the hand presses button 0 and keeps it pressed", Absent{.text = "never"});
  keys.tables("press", draft.simulated.presses, kMostPresses,
              [](Table& presses, SimulatedDevice::Config::Press& press) {
                presses.key("button", press.button, Count{31}, "Number of the button");
                presses.key("from_ms", press.from, kZeroOrMore, "Time at which the button is pressed", kRequired);
                presses.key("for_ms", press.length, kAboveZero, "Time for which the button is held", kRequired);
              });
  keys.table("motion", [&draft](Table& motion) { declare_motion(motion, draft.motion); });
}

template <class Table>
void declare_port(Table& keys, std::string& port) {
  keys.key("port", port, UsbPort{}, "USB port of the device, if there are several",
           Absent{.text = "the first device that is not in use"});
}

template <class Table>
void declare(Table& keys, SimulatedDevice::Config& /*device*/, Draft& draft) {
  SimulatedDevice::Config& config = draft.simulated;
  keys.key("profile", draft.profile, profile_names(),
           "Model of a real device with all of its effects. Each key below overrides one of its values");
  if (draft.profile != nullptr) config = draft.profile->device();
  keys.key("substep_us", config.max_substep, Number{.least = 10, .most = 4000},
           "Maximum time step of the simulation. A longer step requires less processor time, and is as accurate if "
           "nothing stiff is simulated");
  keys.key("start_position_mm", config.start_position, Vector{}, "Initial position of the handle",
           Absent{.text = "the start of the hand's motion, or the origin"});
  keys.table("effects", [&draft](Table& effects) { declare_effects(effects, draft); });
  keys.part({"hand", "simulates the hand of the operator: a spring, a damper and a mass"}, config.hand,
            [&draft](Table& hand, OperatorHand::Config& part) { declare_hand(hand, draft, part); });
  keys.part({"environment", "simulates walls and a medium in which the handle moves"}, config.environment,
            [](Table& environment, SimulatedEnvironment::Config& part) { declare_environment(environment, part); });
  keys.part({"rotation", "simulates the rotation of the handle in the operator's hand"}, config.rotation,
            [&draft](Table& rotation, SimulatedRotation::Config& part) { declare_rotation(rotation, draft, part); });
  keys.part({"gripper", "simulates a gripper with two fingers"}, config.gripper,
            [&draft](Table& gripper, SimulatedGripper::Config& part) { declare_gripper(gripper, draft, part); });
}

template <class Table>
void declare(Table& keys, falcon::Config& device, Draft& /*draft*/) {
  declare_port(keys, device.port);
  keys.key("firmware", device.firmware, Path{},
           "Firmware file of your own Novint software, relative to this file. --falcon-firmware overrides it",
           Absent{.text = "none; only a device that already has its firmware can be used"});
  keys.key("accept_unknown_firmware", device.accept_unknown_firmware, YesNo{},
           "Accept a firmware file that is not one of the known files");
}

template <class Table>
void declare(Table& keys, ReplayDevice::Config& device, Draft& draft) {
  keys.key("recording", draft.replayed, Path{},
           "MCAP recording of tendond, relative to this file. The motion of the hand at its first device is played",
           Absent{.text = "none; a table csv is required"});
  keys.key("at_end", device.at_end, at_end_names(),
           "What happens after the last sample: hold its position, or repeat the motion from the start");
  keys.key("encoder_step_um", device.position_resolution, kZeroOrMore,
           "One encoder count of the recorded device. 0: its positions were exact");
  keys.part("csv", draft.csv, [](Table& csv, RecordedMotionFile& file) { declare_csv(csv, file); });
}

template <class Table>
void declare(Table& keys, spacemouse::Config& device, Draft& /*draft*/) {
  declare_port(keys, device.port);
  keys.key("speed_m_per_s", device.motion.speed, kAboveZero, "Speed of the position while the cap is at its stop");
  keys.key("dead_band", device.motion.dead_band, Number{.least = 0, .most = 0.9},
           "Dead band around the centre, as a share of the way to the stop");
  keys.key("reach_mm", device.motion.reach, kAboveZero,
           "Maximum distance of the position from the origin on each axis");
  keys.key("turn_speed_deg_per_s", device.motion.turn_speed, kAboveZero,
           "Angular speed while the cap is twisted to its stop");
}

template <class Table>
void declare(Table& keys, woodenhaptics::Config& device, Draft& /*draft*/) {
  declare_port(keys, device.port);
  keys.key("model", device.drive.model, ArmModel{}, "Model of the arm", kRequired);
  keys.key("max_current_ma", device.drive.max_current, Number{.least = 1, .most = 6000},
           "Maximum current of each motor, at most the full scale of the amplifiers");
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
    keys.key("name", draft.scene.name, Label{}, "Name by which clients select this device",
             Absent{.text = "the name of the scene file"});
    keys.key("count", draft.scene.count, Count{kMostDevices, 1},
             "For \"simulated\": number of identical devices NAME-0, NAME-1, … All devices of a session must be in the "
             "same bank of 16: NAME-0 to NAME-15, NAME-16 to NAME-31, …");
    keys.key("axes", draft.scene.axes, Axes{},
             "Orientation of the device base frame in front of the operator. Programs use it to rotate positions",
             Absent{.text = "that of the driver; unknown for a recorded hand"});
    keys.key("group", draft.scene.group, Label{},
             "Name of a group. Devices of one body, for example two arms or five fingers, have the same group",
             Absent{.text = "no group"});
    keys.key("held_by", draft.scene.hand,
             Names<Hand>{{{"any", Hand::kAny}, {"left", Hand::kLeft}, {"right", Hand::kRight}}},
             "Hand of the operator that holds the device");
  };
  device.kind(
      kinds, [&draft](Table& keys, std::size_t kind) { declare_kind(kind, keys, draft); }, common);
}

template void declare_device(Reader&, Draft&);
template void declare_device(Reference&, Draft&);
template void declare_device(Parts&, Draft&);

}  // namespace tendon::scene_file
