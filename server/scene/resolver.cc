// SPDX-License-Identifier: Apache-2.0
#include "server/scene/resolver.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/rotation.h"
#include "core/handle/handle_bounds.h"
#include "server/machine/regular_file.h"
#include "server/machine/unix_socket.h"
#include "server/scene/reader.h"
#include "server/scene/recorded_hand.h"
#include "server/scene/values.h"
#include "server/tables/recorded_motion.h"

namespace tendon::scene_file {
namespace {

/// A device that does not respond for this time is a fault, as in libfranka.
constexpr Duration kMostMissed = std::chrono::milliseconds(20);

class SceneResolver : SceneErrors {
 public:
  SceneResolver(Draft draft, const toml::table& file, const std::string& name)
      : SceneErrors(file, name), draft_(std::move(draft)) {}

  Scene scene(const std::filesystem::path& directory) {
    if (!std::holds_alternative<SimulatedDevice::Config>(draft_.scene.device))
      draft_.simulated = draft_.scene.simulated();
    resolve_motion(directory);
    resolve_falcon(directory);
    resolve_woodenhaptics();
    if (draft_.scene.driver().moves_a_hand) expect_a_limiter();
    resolve_network(directory);
    resolve_structural_mode();
    resolve_joint_friction();
    resolve_recording();
    resolve_control();
    resolve_teleoperation(directory);
    resolve_replay(directory);
    resolve_channels();
    resolve_fields();
    resolve_count();
    // Some rules are only checked by the constructors.
    Scene& scene = draft_.scene;
    SimulatedDevice::Config& simulated = draft_.simulated;
    build("device", [&simulated] { SimulatedDevice{simulated}; });
    if (auto* device = std::get_if<SimulatedDevice::Config>(&scene.device)) *device = simulated;
    build("force", [&scene] { HeldForce{scene.loop.control.hold}; });
    resolve_safety();
    build("limiter", [&scene] { Limiter{scene.loop.control.limiter}; });
    build("loop", [&scene] { HapticController{scene.loop.control}; });
    return std::move(scene);
  }

 private:
  [[noreturn]] void blame_file(std::string_view key, const UnreadableFile& refused) const {
    try {
      blame(key, {}, refused.what());
    } catch (const SceneError& error) {
      throw SceneFileError(error.what());
    }
  }

  static ScriptedMotion::Recorded read_motion(RecordedMotionFile& file, const std::filesystem::path& directory) {
    file.path = directory / file.path;
    std::ifstream csv = open_regular_file(file.path);
    return load_recorded_motion(csv, file);
  }

  ScriptedMotion motion_of(DraftMotion& draft, const std::string& table, const std::filesystem::path& directory) {
    std::optional<ScriptedMotion> motion;
    build(table + ".motion", [&] {
      if (draft.recorded) {
        try {
          draft.script = read_motion(*draft.recorded, directory);
        } catch (const UnreadableFile& refused) {
          blame_file(table + ".motion.file", refused);
        } catch (const std::runtime_error& refused) {
          blame(table + ".motion.file", {}, refused.what());
        }
      }
      motion.emplace(draft.script);
    });
    const HandleBounds& bounds = table == "device.hand" ? kMovementBounds : kRotationBounds;
    const Unit& unit = unit_of(table == "device.hand" ? "_mm" : "_deg");
    if (const double found = length_of(draft.script); found > bounds.travel) {
      const std::string key = table + ".motion.";
      blame(table + ".motion",
            {key + "amplitude_mm", key + "amplitude_deg", key + "to_mm", key + "to_deg", key + "points_mm",
             key + "points_deg", key + "file"},
            "expected a motion of at most " + with_symbol(digits(std::round(bounds.travel * unit.per_si)), unit) +
                " from end to end, which no handle exceeds, found " +
                with_symbol(digits(std::round(found * unit.per_si)), unit));
    }
    return *std::move(motion);
  }

  static double length_of(const ScriptedMotion::Script& script) {
    if (const auto* sine = std::get_if<ScriptedMotion::Sine>(&script)) return 2 * sine->amplitude;
    if (const auto* recorded = std::get_if<ScriptedMotion::Recorded>(&script)) {
      const auto [least, most] = std::ranges::minmax(recorded->samples, {}, &ScriptedMotion::Recorded::Sample::x);
      return most.x - least.x;
    }
    std::vector<Vec3> points;
    if (const auto* ramp = std::get_if<ScriptedMotion::RampHold>(&script)) points = {ramp->from, ramp->to};
    if (const auto* reach = std::get_if<ScriptedMotion::MinimumJerk>(&script)) points = reach->points;
    Vec3 least = points.front();
    Vec3 most = points.front();
    for (const Vec3& point : points) {
      least = least.cwiseMin(point);
      most = most.cwiseMax(point);
    }
    return (most - least).maxCoeff();
  }

  void resolve_motion(const std::filesystem::path& directory) {
    if (auto& hand = draft_.simulated.hand) hand->motion = motion_of(draft_.motion, "device.hand", directory);
    if (auto& rotation = draft_.simulated.rotation) {
      if (rotation->hand) rotation->hand->motion = motion_of(draft_.turning, "device.rotation.hand", directory);
      build("device.rotation", [&rotation] { SimulatedRotation{*rotation}; });
    }
    if (auto& gripper = draft_.simulated.gripper) {
      if (gripper->hand) gripper->hand->motion = motion_of(draft_.gripping, "device.gripper.hand", directory);
      if (gripper->start && *gripper->start > gripper->open) {
        const Unit& unit = unit_of("_deg");
        const auto degrees = [&unit](double angle) { return digits(std::round(angle * unit.per_si * 1e9) / 1e9); };
        blame("device.gripper.start_deg", {},
              "expected at most open_deg, which is " + with_symbol(degrees(gripper->open), unit) + ", found " +
                  degrees(*gripper->start));
      }
      build("device.gripper", [&gripper] { SimulatedGripper{*gripper}; });
    }
  }

  void resolve_falcon(const std::filesystem::path& directory) {
    auto* falcon = std::get_if<falcon::Config>(&draft_.scene.device);
    if (falcon != nullptr && falcon->firmware) falcon->firmware = directory / *falcon->firmware;
  }

  void expect_a_limiter() const {
    if (draft_.scene.loop.control.limiter.law != Law::kNone) return;
    blame("limiter.kind", {}, "expected a limiter, found \"none\", which is for simulated devices only");
  }

  void resolve_woodenhaptics() {
    const auto* device = std::get_if<woodenhaptics::Config>(&draft_.scene.device);
    if (device == nullptr) return;
    const WoodenHapticsDevice::Config& drive = device->drive;
    const Unit& unit = unit_of("max_current_ma");
    if (drive.max_current > drive.model->full_scale) {
      blame("device.max_current_ma", {},
            "expected at most " + with_symbol(Number::shown(unit, drive.model->full_scale), unit) +
                ", the full scale of its amplifiers, found " + Number::shown(unit, drive.max_current));
    }
  }

  void resolve_replay(const std::filesystem::path& directory) {
    auto* device = std::get_if<ReplayDevice::Config>(&draft_.scene.device);
    if (device == nullptr) return;
    ReplayDevice::Config& replay = *device;
    auto& csv = draft_.csv;
    if (draft_.replayed.has_value() == csv.has_value()) {
      blame("device", {}, std::string("expected either recording or a table csv, found ") + (csv ? "both" : "neither"));
    }
    const std::string_view source = csv ? "device.csv.file" : "device.recording";
    build(source, [&] {
      try {
        replay.samples = csv ? ReplayDevice::samples_of(read_motion(*csv, directory))
                             : read_recorded_hand(directory / *draft_.replayed);
      } catch (const UnreadableFile& refused) {
        blame_file(source, refused);
      } catch (const std::runtime_error& refused) {
        blame(source, {}, refused.what());
      }
      ReplayDevice{replay};
    });
    const HapticLoop::Config& loop = draft_.scene.loop;
    // The device does not provide positions between samples.
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

  void resolve_structural_mode() const {
    const SimulatedDevice::Config& device = draft_.simulated;
    if (!device.structural_mode || device.structural_mode->handle_mass < device.mass) return;
    blame("device.effects.structural_mode.handle_mass_kg", {},
          "expected less than mass_kg, which is " + digits(device.mass) + " kg, found " +
              digits(device.structural_mode->handle_mass));
  }

  void resolve_count() const {
    const Scene& scene = draft_.scene;
    if (scene.count == 1) return;
    const auto refuse = [&](const std::string& expected) {
      blame("device.count", {}, "expected " + expected + ", found " + std::to_string(scene.count));
    };
    if (!std::holds_alternative<SimulatedDevice::Config>(scene.device)) {
      refuse("1, because kind is \"" + std::string(scene.driver().kind) +
             "\" and only simulated devices can have a count");
    }
    if (scene.teleoperation) refuse("1 with [teleoperation], which couples one device");
    if (scene.discovery && scene.discovery->announce) refuse("1 with [discovery], which announces one device");
    const std::string longest = scene.name_of(scene.count - 1);
    if (longest.size() <= limits::kMaxLabel) return;
    blame("device.name", {"device.count"},
          "expected a name with which \"" + longest + "\" has at most " + std::to_string(limits::kMaxLabel) +
              " letters, found " + std::to_string(longest.size()));
  }

  void resolve_recording() const {
    const auto& recording = draft_.scene.recording;
    if (!recording || !recording->one_in || recording->keep == Keep::kFaults) return;
    blame("recording.one_in", {},
          "expected keep = \"faults\" with one_in, found keep = \"all\", which keeps every file");
  }

  /// The profiles only contain the friction of the handle.
  void resolve_joint_friction() {
    SimulatedDevice::Config& device = draft_.simulated;
    if (!device.joint_friction) return;
    const std::string table = "device.effects.joint_friction";
    const std::string_view handles = "device.effects.coulomb_friction_n";
    if (draft_.joint_coulomb) {
      if (const auto node = file_.at_path(handles); node && node.is_number()) {
        blame(handles, {},
              "expected false with coulomb_n_m of [" + table + "], found " + found_in(*node.node()) +
                  ": the friction is either in the joints or at the handle");
      }
      device.joint_friction->coulomb = *draft_.joint_coulomb;
    } else if (device.coulomb_friction) {
      device.joint_friction->coulomb =
          JointFriction::torques(device.joint_friction->mechanism, *device.coulomb_friction);
    }
    device.coulomb_friction.reset();
    build(table, [&device] { JointFriction{*device.joint_friction}; });
  }

  void resolve_channels() {
    Scene& scene = draft_.scene;
    scene.loop.control.channels.clear();
    for (std::size_t i = 0; i < scene.channels.size(); ++i) {
      scene.loop.control.channels.push_back(scene.channels[i].rule);
      for (std::size_t before = 0; before < i; ++before) {
        if (scene.channels[before].name != scene.channels[i].name) continue;
        blame("channel[" + std::to_string(i) + "].name", {},
              "expected a unique name, found " + in_quotes(scene.channels[i].name) + " again");
      }
    }
  }

  void resolve_fields() {
    Scene& scene = draft_.scene;
    for (const std::string& allowed : scene.fields.channels) {
      std::vector<std::string_view> names;
      for (const Scene::Channel& channel : scene.channels) names.push_back(channel.name);
      if (std::ranges::find(names, allowed) != names.end()) continue;
      std::string known;
      for (const std::string_view name : names) known += (known.empty() ? "" : ", ") + in_quotes(name);
      blame("field.allow", {},
            "expected names of channels, which are " + known + ", found " + in_quotes(allowed) +
                did_you_mean(allowed, names));
    }
    HapticController::Config& control = scene.loop.control;
    if (!control.hold.field) return;
    const field::EnergyGate::Config& push = control.hold.field->push;
    if (push.push_j == 0 && push.push_w == 0) return;
    expect_shared_account(push.push_j > 0 ? "field.push_j" : "field.push_w");
    control.limiter.shared_account = true;
  }

  /// `key` requires that energy can be credited to the account of the limiter.
  void expect_shared_account(const std::string& key) const {
    const LimiterConfig& limiter = draft_.scene.loop.control.limiter;
    const Law law = limiter.law;
    if (law != Law::kAolPlus && law != Law::kAol && law != Law::kAolBox) {
      blame(key, {"limiter.kind"},
            "expected the limiter \"aol+\", \"aol\" or \"aol-box\": other limiters have no energy account that ports "
            "can share");
    }
    if (limiter.parts.latency_reserve) {
      blame("limiter.latency_reserve", {},
            "expected none with " + key + ": the reserve is not proved for an account that is shared by several ports");
    }
  }

  void resolve_safety() {
    Scene& scene = draft_.scene;
    // A device that moves a real hand must always be armed explicitly.
    if (scene.driver().moves_a_hand && !scene.safety) scene.safety.emplace();
    if (!scene.safety) return;
    if (scene.safety->dead_man) {
      const std::uint32_t button = scene.safety->dead_man->button;
      const Driver& driver = scene.driver();
      if (driver.moves_a_hand && button >= driver.buttons.size()) {
        blame("safety.dead_man.button", {},
              "expected " + std::string(driver.buttons_in_words) + ", found " + std::to_string(button));
      }
      if (!driver.moves_a_hand && !is_pressed(button)) {
        blame("safety.dead_man.button", {},
              "expected 0 with button_after_ms of [device.hand], or a button of [[device.hand.press]]: a simulated "
              "device has no other buttons");
      }
    }
    build("safety", [&scene, this] {
      SimulatedDevice device{draft_.simulated};
      SafeDevice{*scene.safety, device};
    });
  }

  bool is_pressed(std::uint32_t button) const {
    const SimulatedDevice::Config& device = draft_.simulated;
    return (device.button_after && button == 0) ||
           std::ranges::any_of(device.presses, [button](const auto& press) { return press.button == button; });
  }

  void resolve_network(const std::filesystem::path& directory) {
    Scene::Network& network = draft_.scene.network;
    if (network.keys) network.keys = directory / *network.keys;
    if (network.suites.empty()) {
      blame("network.suites", {}, "expected some of " + names_of(all_suites()) + ", found an empty list");
    }
    if (!network.keys && file_.at_path("network.suites")) {
      blame("network.suites", {}, "expected no suites without keys, because the sessions are not encrypted");
    }
    // This is also checked by UdpLink, but the line is only known here.
    if (network.unix_path && network.unix_path->native().size() > UnixSocket::kMostPath) {
      blame("network.unix", {},
            "expected a path of at most " + std::to_string(UnixSocket::kMostPath) + " bytes, found " +
                std::to_string(network.unix_path->native().size()));
    }
    if (!network.keys && !is_loopback(network.listen)) {
      blame("network.listen", {},
            "expected a loopback address like \"127.0.0.1:47100\" or \"[::1]:47100\", or a folder of keys: without "
            "keys, anyone on the network could command forces");
    }
  }

  void resolve_control() {
    const SimulatedDevice::Config& device = draft_.simulated;
    HapticLoop::Config& loop = draft_.scene.loop;
    HapticController::Config& control = loop.control;

    // Without real-time priority, a loop is occasionally delayed by up to one period. Longer holds are overruns.
    control.limiter.longest_hold = draft_.longest_hold.value_or(2 * loop.period);
    control.limiter.follow_holds.reset();
    if (draft_.follow_holds.memory > Duration::zero()) control.limiter.follow_holds = draft_.follow_holds;
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
            "expected a device with force_sensor in [device.effects], because the force of the hand moves the virtual "
            "tool");
    }

    const std::optional<double> most = draft_.scene.driver().exerts_force ? device.max_force : kUnfelt;
    if (!draft_.max_force && !most) {
      blame("force.max_force_n", {}, "missing, expected a number above 0 N, because the device has no max_force_n");
    }
    control.max_force = draft_.max_force ? *draft_.max_force : *most;

    resolve_limiter(draft_, *this);
  }

  /// The peer's configuration is compared with the result when the connection is established.
  void resolve_teleoperation(const std::filesystem::path& directory) {
    auto& peer = draft_.scene.teleoperation;
    if (!peer) return;
    HapticController::Config& control = draft_.scene.loop.control;
    Coupling::Config& coupling = draft_.coupling;
    const bool leads = coupling.role == PortRole::kLeader;
    if (peer->key) peer->key = directory / *peer->key;
    if (peer->key && !peer->dial) {
      blame("teleoperation.key", {},
            "expected no key without dial, because a server that is dialled uses the keys of [network]");
    }
    if (peer->dial && !is_loopback(*peer->dial)) {
      if (!peer->key) {
        blame("teleoperation.dial", {},
              "expected a loopback address, or a key: connections over a network must be encrypted");
      }
      if (is_loopback(draft_.scene.network.listen)) {
        blame("network.listen", {"network.listen", "teleoperation.dial"},
              "expected an address that reaches the peer, like \"0.0.0.0:47100\", because teleoperation.dial is on "
              "another machine");
      }
    }
    resolve_coupled_turn(control);
    resolve_coupled_grip(control);
    if (draft_.engages_by_button != draft_.engage_button.has_value() || (!leads && draft_.engages_by_button)) {
      blame("teleoperation.engage.by", {"teleoperation.engage.button"},
            leads ? "expected \"button\" together with button, or \"request\" without"
                  : "expected \"request\" for a follower: only a leader can engage by a button");
    }
    coupling.engage_by = draft_.engage_button;
    resolve_absolute(coupling, leads);
    coupling.map.rotation = rotation_by(draft_.map_rotation);
    coupling.spring.period = draft_.scene.loop.period;
    coupling.encoder_step = draft_.encoder_step().value_or(0);
    coupling.spring.max_force = draft_.coupling_force.value_or(control.max_force);
    const Law law = control.limiter.law;
    resolve_leaders(coupling);
    resolve_method(coupling);
    blame_rules(coupling);
    if (info(coupling.method).needs_tank && law != Law::kNone && !coupling.tank) {
      blame("teleoperation.energy_tank", {"teleoperation"},
            "missing, expected this table: with its own limiter, a follower can only move with energy from the leader");
    }
    const bool waves = coupling.method == CouplingMethod::kWaves;
    const bool shares = coupling.tank || (waves && law != Law::kNone);
    const std::string what = coupling.tank ? "teleoperation.energy_tank" : "teleoperation.method";
    if (shares) expect_shared_account(what);
    control.limiter.shared_account = shares;
    build("teleoperation", [&coupling] { Coupling{coupling}; });
    control.coupling = coupling;
  }

  void resolve_absolute(Coupling::Config& coupling, bool leads) const {
    if (draft_.absolute_map) {
      coupling.absolute = Coupling::Absolute{.energy = draft_.align_energy};
      if (draft_.align_within) coupling.absolute->within = *draft_.align_within;
    }
    const bool aligns = leads && draft_.absolute_map;
    if (draft_.align_within && !aligns) {
      blame("teleoperation.engage.within_mm", {},
            "expected no within_mm, except for a leader with map.absolute: only this leader is aligned");
    }
    if (draft_.align_energy > 0 && !(aligns && coupling.tank)) {
      blame(
          "teleoperation.engage.align_energy_mj", {},
          "expected 0, except for a leader with map.absolute and an energy tank: the energy is paid into its account");
    }
  }

  void resolve_leaders(const Coupling::Config& coupling) {
    const Scene::Teleoperation& peer = *draft_.scene.teleoperation;
    const std::vector<Scene::Channel>& channels = draft_.scene.channels;
    if (peer.leaders.empty()) return;
    const std::string table = "teleoperation.leader";
    if (coupling.role == PortRole::kLeader) {
      blame(table, {}, "expected no such table for a leader, because the follower lists all leaders");
    }
    if (peer.dial) {
      blame("teleoperation.dial", {},
            "expected no dial with [[teleoperation.leader]]: several leaders dial their follower");
    }
    if (peer.leaders.size() < 2)
      blame(table, {}, "expected 2 to 4 tables, or no table for a single leader on any channel");
    Coupling::Config one = coupling;
    one.share = peer.leaders.front().share;
    blame_rules(one);
    if (coupling.turn || coupling.grip) {
      blame(coupling.turn ? "teleoperation.turn" : "teleoperation.grip", {},
            "expected no such table with several leaders, because they only share positions");
    }
    double sum = 0;
    auto& leaders = draft_.scene.loop.control.leaders;
    for (std::size_t i = 0; i < peer.leaders.size(); ++i) {
      const std::string key = table + "[" + std::to_string(i) + "].channel";
      const auto& [channel, share] = peer.leaders[i];
      const auto named = std::ranges::find(channels, channel, &Scene::Channel::name);
      if (named == channels.end()) {
        blame(key, {}, "expected the name of a [[channel]], found " + in_quotes(channel));
      }
      const auto number = static_cast<std::uint32_t>(named - channels.begin());
      if (std::ranges::count(leaders, number, &CoupledLeader::channel) > 0) {
        blame(key, {}, "expected a different channel for each leader, found " + in_quotes(channel) + " again");
      }
      leaders.push_back({.channel = number, .share = share});
      sum += share;
    }
    if (!(std::abs(sum - 1) <= Shares::kRounding)) {
      blame(table, {}, "expected shares with the sum 1, found " + digits(sum));
    }
  }

  /// Checks the keys that are only used by some of the methods.
  void resolve_method(Coupling::Config& coupling) const {
    const std::string named = "\"" + std::string(to_string(coupling.method)) + "\"";
    if (draft_.drift_rate && coupling.method != CouplingMethod::kPassivity) {
      blame("teleoperation.coupling.drift_rate_per_s", {},
            "expected none with method " + named + ": only \"passivity\" corrects drift");
    }
    coupling.drift_rate = draft_.drift_rate.value_or(coupling.drift_rate);
    if (!info(coupling.method).has_velocity && coupling.spring.damping > 0) {
      blame("teleoperation.coupling.mutual_damping_n_s_per_m", {},
            "expected 0 or no value with method " + named + ": it does not use the velocity of the other end");
    }
  }

  /// Reports the line of the key that violates a rule.
  void blame_rules(const Coupling::Config& coupling) const {
    struct Row {
      std::string_view field;
      std::string_view key;
      std::string_view place;
    };
    static constexpr Row kRows[] = {
        {"clutch", "teleoperation.clutch", "teleoperation.clutch"},
        {"holds_place", "teleoperation.on_loss", "teleoperation.on_loss"},
        {"engage_by", "teleoperation.engage.by", "teleoperation.engage.button"},
        {"absolute", "teleoperation.map.absolute", "teleoperation.map.absolute"},
        {"method", "teleoperation.method", "teleoperation.method"},
        {"rate", "teleoperation.rate", "teleoperation.rate"},
        {"centring", "teleoperation.rate.centring_n_per_m", "teleoperation.rate.centring_n_per_m"},
        {"own_damping", "teleoperation.coupling.damping_n_s_per_m", "teleoperation.method"}};
    for (const auto& [field, sentence] : Coupling::check(coupling)) {
      const auto* row = std::ranges::find(kRows, field, &Row::field);
      if (row == std::end(kRows)) blame("teleoperation", {}, std::string(field) + ": " + sentence);
      blame(row->key, {row->place, "teleoperation.method"}, sentence);
    }
  }

  void resolve_coupled_turn(const HapticController::Config& control) {
    Coupling::Config& coupling = draft_.coupling;
    if (!coupling.turn) return;
    const bool leads = coupling.role == PortRole::kLeader;
    if (!draft_.simulated.rotation) {
      blame("teleoperation.turn", {},
            "expected a device with [device.rotation]: this device does not measure the orientation of its handle");
    }
    if (!leads && !control.rotation) {
      blame(
          "teleoperation.turn", {},
          "expected a device with max_torque_nm in [device.rotation]: a follower requires motors that turn its handle");
    }
    if (control.rotation) coupling.turn->max_torque = control.rotation->max_torque;
    const bool waves = coupling.method == CouplingMethod::kWaves;
    if (waves && control.limiter.law != Law::kNone && !coupling.tank) {
      blame("teleoperation.energy_tank", {"teleoperation.turn"},
            "missing, expected this table: waves do not transmit rotations, so the energy that turns the follower must "
            "come from the leader");
    }
  }

  /// A gripper cannot move without energy from the other end, so both grippers must have motors.
  void resolve_coupled_grip(const HapticController::Config& control) {
    Coupling::Config& coupling = draft_.coupling;
    if (!coupling.grip) return;
    if (!draft_.simulated.gripper) {
      blame("teleoperation.grip", {},
            "expected a device with [device.gripper]: this device does not measure the opening of a gripper");
    }
    if (!control.grip) {
      blame("teleoperation.grip", {},
            "expected a device with max_force_n in [device.gripper]: a gripper without a motor cannot follow and "
            "cannot be felt");
    }
    coupling.grip->arm = control.grip->arm;
    coupling.grip->max_force = control.grip->max_force;
    if (control.limiter.law != Law::kNone && !coupling.tank) {
      blame("teleoperation.energy_tank", {"teleoperation.grip"},
            "missing, expected this table: with its own limiter, a gripper can only move with energy from the leader");
    }
  }

  static std::string at_least(Duration least, const std::string& what, Duration found, std::string_view suffix) {
    const Unit& unit = unit_of(suffix);
    return "expected " + what + " of " + with_symbol(Number::shown(unit, least), unit) + " or more, found " +
           Number::shown(unit, found);
  }

  Draft draft_;
};

}  // namespace

Scene resolve(Draft draft, const toml::table& file, const std::string& name, const std::filesystem::path& directory) {
  return SceneResolver(std::move(draft), file, name).scene(directory);
}

}  // namespace tendon::scene_file
