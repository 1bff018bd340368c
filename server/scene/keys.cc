// SPDX-License-Identifier: Apache-2.0
#include "server/scene/keys.h"

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "core/control/aol_parts.h"
#include "protocol/limits.h"
#include "server/scene/parts.h"
#include "server/scene/reader.h"
#include "server/scene/reference.h"
#include "server/scene/values.h"

namespace tendon::scene_file {
namespace {

Names<Law> law_names() {
  Names<Law> names;
  for (const LawInfo& law : laws()) names.all.emplace_back(law.name, law.law);
  return names;
}

Names<std::optional<Preset>> preset_names() {
  Names<std::optional<Preset>> names{{{"none", std::nullopt}}};
  for (const PresetInfo& preset : presets()) names.all.emplace_back(preset.name, preset.preset);
  return names;
}

Names<Suite> suite_names() {
  Names<Suite> names;
  for (const NamedSuite& one : kSealedSuites) names.all.emplace_back(one.name, one.suite);
  return names;
}

std::string preset_meanings() {
  std::string text;
  for (const PresetInfo& preset : presets()) {
    const PresetDevice any{.longest_hold = std::chrono::milliseconds(1)};
    text += (text.empty() ? "\"" : ". \"") + std::string(preset.name) + "\": " + std::string(preset.what) + "; " +
            promise_of({.parts = preset_parts(preset.preset, any).parts});
  }
  return text;
}

enum class WorkspaceShape : std::uint8_t { kSphere, kBox };

template <class Table>
void declare_workspace(Table& workspace, Workspace::Config& config) {
  const Names<WorkspaceShape> shapes{{{"sphere", WorkspaceShape::kSphere}, {"box", WorkspaceShape::kBox}}};
  workspace.kind(shapes, [&config](Table& keys, WorkspaceShape shape) {
    if (shape == WorkspaceShape::kSphere) {
      auto& sphere = config.shape.emplace<Workspace::Sphere>();
      keys.key("radius_mm", sphere.radius, kAboveZero, "of the space inside which forces are given whole", kRequired);
    } else {
      auto& box = config.shape.emplace<Workspace::Box>();
      keys.key("half_mm", box.half, Vector{}, "half the edges of the space inside which forces are given whole",
               kRequired);
    }
    keys.key("centre_mm", config.centre, Vector{}, "the centre of that space");
    keys.key("margin_mm", config.margin, kAboveZero, "this far outside it, no force pushes further outwards",
             kRequired);
  });
}

template <class Table>
void declare_watchdog(Table& keys, Watchdog::Config& dog, std::string_view meaning) {
  keys.key("timeout_ms", dog.timeout, kAboveZero, meaning, kRequired);
  keys.key("ramp_ms", dog.ramp, kZeroOrMore, "after that the force falls to zero within this time");
}

template <class Table>
void declare_safety(Table& safety, SafeDevice::Config& config) {
  using By = SafeDevice::Arming::By;
  safety.key(
      "arm", config.arming.by,
      Names<By>{{{"by request", By::kRequest}, {"at start", By::kStart}, {"by dead man", By::kDeadMan}}},
      "who arms the device. By request: a guest (rearm). At start: the device itself the first time, then a guest. By "
      "dead man: whoever presses the dead man's button");
  safety.key("rest_speed_m_per_s", config.arming.rest_speed, kAboveZero,
             "the device is armed only after its handle was no faster than this for 50 ms");
  safety.key("rest_force_n", config.arming.rest_force, kAboveZero,
             "the device is armed only while no larger force than this is asked for");
  safety.key("rest_torque_nm", config.arming.rest_torque, kAboveZero,
             "the device is armed only while no larger torque than this is asked for");
  safety.key("patience_ms", config.arming.patience, kAboveZero,
             "a request to arm that is not granted within this time is forgotten");
  safety.part({"force_limit", "no force is longer"}, config.force_limit, [](Table& keys, auto& part) {
    keys.key("max_n", part.max, kAboveZero, "a longer force is shortened to this; its direction is kept", kRequired);
  });
  safety.part({"growth_limit", "no force grows faster"}, config.growth_limit, [](Table& keys, auto& part) {
    keys.key("rate_n_per_s", part.rate, kAboveZero, "a force grows no faster than this; it may fall at once",
             kRequired);
  });
  safety.part({"ramp_in", "forces begin slowly after arming"}, config.ramp_in, [](Table& keys, auto& part) {
    keys.key("time_ms", part.time, kAboveZero, "time from arming to the whole force, which rises from zero", kRequired);
  });
  safety.part({"heat_limit", "motors do not burn"}, config.heat_limit, [](Table& keys, auto& part) {
    keys.key("peak_n", part.peak, kAboveZero, "the largest force while the motors are cool", kRequired);
    keys.key("continuous_n", part.continuous, kAboveZero, "the force that the motors bear for ever. Not above peak_n",
             kRequired);
    keys.key("time_constant_ms", part.time_constant, kAboveZero, "time constant with which the motors heat up",
             kRequired);
  });
  safety.part({"workspace", "nothing pushes the hand out of it"}, config.workspace,
              [](Table& keys, auto& part) { declare_workspace(keys, part); });
  safety.part({"speed_trip", "a handle that flies gets no force"}, config.speed_trip, [](Table& keys, auto& part) {
    keys.key("max_m_per_s", part.max, kAboveZero,
             "a handle faster than this is a fault: no force until the device is armed again", kRequired);
  });
  safety.part({"step_bound", "encoders that wrap or lose count disarm it"}, config.step_bound,
              [](Table& keys, auto& part) {
                keys.key("max_speed_m_per_s", part.max_speed, kAboveZero,
                         "a position further away than a hand can move at this speed is a fault", kRequired);
              });
  safety.part(
      {"command_watchdog", "a loop that stood still gets no force"}, config.command_watchdog,
      [](Table& keys, auto& part) { declare_watchdog(keys, part, "no force was commanded for longer than this"); });
  safety.part({"link_watchdog", "a device that was silent gets no force"}, config.link_watchdog,
              [](Table& keys, auto& part) { declare_watchdog(keys, part, "the newest position is older than this"); });
  safety.part({"dead_man", "no force unless the button is held"}, config.dead_man, [](Table& keys, auto& part) {
    keys.key("button", part.button, Count{31}, "no force unless this button is held", kRequired);
  });
  safety.part({"torque_limit", "no torque is longer"}, config.torque_limit, [](Table& keys, auto& part) {
    keys.key("max_nm", part.max, kAboveZero,
             "a longer torque is shortened to this, and the force by the same share: a wrench keeps its direction",
             kRequired);
  });
  safety.part(
      {"torque_growth_limit", "no torque grows faster"}, config.torque_growth_limit, [](Table& keys, auto& part) {
        keys.key("rate_nm_per_s", part.rate, kAboveZero,
                 "a torque grows no faster than this, and its force no faster in proportion; it may fall at once",
                 kRequired);
      });
  safety.part({"turn_trip", "a handle that spins gets no force"}, config.turn_trip, [](Table& keys, auto& part) {
    keys.key("max_deg_per_s", part.max, kAboveZero,
             "a handle that turns faster than this is a fault: no force until the device is armed again", kRequired);
  });
  safety.part({"grip_limit", "no grip is larger"}, config.grip_limit, [](Table& keys, auto& part) {
    keys.key("max_n", part.max, kAboveZero, "a larger force on the fingers is reduced to this", kRequired);
  });
  safety.part({"grip_growth_limit", "no grip grows faster"}, config.grip_growth_limit, [](Table& keys, auto& part) {
    keys.key("rate_n_per_s", part.rate, kAboveZero,
             "a force on the fingers grows no faster than this; it may fall at once", kRequired);
  });
}

/// Declares the parts of AOL+. Each part is enabled if its table is present.
template <class Table>
void declare_parts(Table& limiter, Draft& draft) {
  using Plus = PointAolPlus;
  const auto declare = [&]<class Config>(std::optional<Config> Plus::Parts::*config, const auto& keys) {
    const auto& row = std::get<AolPart<Config>>(kAolParts);
    limiter.part({row.name, row.what}, draft.scene.loop.control.limiter.parts.*config, keys);
  };
  declare(&Plus::Parts::energy_cap, [](Table& keys, Plus::EnergyCap& cap) {
    keys.key("energy_mj", cap.energy, kZeroOrMore, "the most credit that outlasts the contact in which it was earned");
    keys.key("most_contact_mj", cap.most_contact, kZeroOrMore, "the most credit that one contact may add");
  });
  declare(&Plus::Parts::robust_ledger, [&draft](Table& keys, Plus::Robust& robust) {
    keys.key("encoder_step_um", draft.ledger_step, kZeroOrMore, "one encoder count: its rounding never earns credit",
             Absent{.text = "the device's; required when the device has none"});
    keys.key("window", robust.window, Count{1000, 1}, "haptic periods for each credit of viscous friction");
  });
  declare(&Plus::Parts::knee, [](Table& keys, Plus::Knee& knee) {
    keys.key("start", knee.start, Number{.least = 0.01, .most = 0.99},
             "share of the bound from which on forces are compressed instead of clipped");
  });
  declare(&Plus::Parts::latency_reserve, [](Table& keys, Plus::LatencyReserve& reserve) {
    keys.key("holds", reserve.holds, Count{Plus::kMostHolds, 1},
             "periods from when a force is chosen to when the device begins to hold it. Not with bounded_acceleration");
  });
  declare(&Plus::Parts::bounded_acceleration, [](Table& keys, Plus::BoundedAcceleration& bounded) {
    keys.key("most_m_per_s2", bounded.most[0], kAboveZero,
             "the handle never accelerates harder: the largest forces of hand and motors, over the apparent mass");
  });
  declare(&Plus::Parts::shaping, [](Table& keys, Plus::Shaping& shaping) {
    keys.key("stiffness_n_per_m", shaping.stiffness[0], kAboveZero, "no object is shown stiffer than this");
  });
  declare(&Plus::Parts::adaptive_friction, [&draft](Table& keys, Plus::AdaptiveFriction& adaptive) {
    keys.key("rise_ms", adaptive.rise, kAboveZero, "time constant with which the bounds may rise; they fall at once");
    keys.key("places_mm", draft.places, ListOf<Vector>{}, "where the friction was identified", kRequired);
    keys.key("coulomb_friction_n", draft.place_coulomb, ListOf<Number>{kZeroOrMore},
             "lower bound of the Coulomb friction at each of the places", kRequired);
    keys.key("viscous_friction_n_s_per_m", draft.place_viscous, ListOf<Number>{kZeroOrMore},
             "lower bound of the viscous friction at each of the places", kRequired);
    keys.key(
        "reach_mm", draft.friction_map.reach, kZeroOrMore,
        "the limiter uses the least bound of the nearest place and of all places within this distance of the hand");
  });
  declare(&Plus::Parts::thrift, [](Table& keys, Plus::Thrift& thrift) {
    keys.key("share", thrift.share, Number{.least = 0.01, .most = 1},
             "the most of a force that is kept back while the hand is let out");
    keys.key("energy_mj", thrift.energy, kAboveZero, "with more credit than this nothing is kept back");
  });
  declare(&Plus::Parts::damper, [](Table& keys, Plus::Damper& damper) {
    keys.key("damping_n_s_per_m", damper.viscous[0], kAboveZero,
             "what a vibration of the hand in contact is damped with");
    keys.key("smoothing_ms", damper.smoothing, kAboveZero, "time constant of the velocity's two filters");
    keys.key("slow_ms", damper.slow, kAboveZero, "motion slower than this is not vibration");
    keys.key("dead_zone", damper.dead_zone, kZeroOrMore,
             "in pulses that one encoder count makes: a smaller motion is not damped");
  });
  declare(&Plus::Parts::fading_contact, [](Table& keys, Plus::FadingContact& fading) {
    keys.key("memory_ms", fading.memory, kAboveZero,
             "for energy_cap: time constant with which the credit of a contact that has ended fades");
  });
}

Names<OutputEstimator::Model> estimator_models() {
  using enum OutputEstimator::Model;
  return {{{"polynomial", kPolynomial}, {"spring-and-bias", kSpringAndBias}, {"output-error", kOutputError}}};
}

/// At most one of these tables is allowed.
template <class Table>
void declare_between(Table& force, HeldForce::Config& hold) {
  const Name model{"adaptive_local_model", "models of the engine are blended and capped"};
  force.part(model, hold.adaptive_local_model, [](Table& keys, AdaptiveLocalModel::Config& config) {
    keys.key("share", config.share, Number{.least = 0.01, .most = 1},
             "share of the engine's stiffness that is followed; below 1 when the engine only estimates it");
    keys.key("max_blend_ms", config.max_blend, kAboveZero, "a new model is blended in for one engine period, or this");
  });
  const Name estimator{"output_estimator", "the environment is learnt from its answers"};
  force.part(estimator, hold.output_estimator, [](Table& keys, OutputEstimator::Config& config) {
    keys.key("model", config.model, estimator_models(), "the model of the environment, on each axis");
    keys.key("origin_mm", config.origin, Vector{}, "where the environment is at rest");
    keys.key("scale_mm", config.scale, kAboveZero, "about how far the hand moves within the environment");
    keys.key("forgetting", config.forgetting, Number{.least = 0.5, .most = 1},
             "factor by which each answer lowers the weight of those before");
    keys.key("dead_zone_n", config.dead_zone, kZeroOrMore, "smaller errors are taken for the engine's noise");
    keys.key("reset_error_n", config.reset_error, kAboveZero,
             "a larger error means another environment: the estimate begins anew");
    keys.key("reset_cooldown", config.reset_cooldown, Count{1000, 1}, "the fewest answers between two such beginnings");
    keys.key("max_stiffness_n_per_m", config.max_stiffness, kAboveZero, "no stiffer environment is believed");
    keys.key("largest_n", config.max_force, kAboveZero, "the largest estimate of the force, on each axis");
    keys.key("resolution_um", config.resolution, kZeroOrMore, "one encoder count: motion below it teaches nothing");
  });
  const Name learned{"learned_model", "an answer is led to where the hand is now"};
  force.part(learned, hold.learned_model, [](Table& keys, LearnedModel::Config& config) {
    keys.key("least_travel_um", config.least_travel, kAboveZero, "a hand that has moved less teaches nothing");
    keys.key("gain", config.gain, Number{.least = 0.01, .most = 1}, "share of an error that one lesson corrects");
    keys.key("forgetting", config.forgetting, Number{.least = 0.5, .most = 0.999},
             "factor by which each lesson lowers the weight of those before, for trust");
    keys.key("max_stiffness_n_per_m", config.max_stiffness, kAboveZero, "no stiffer environment is believed");
    keys.key("blend_ms", config.blend, kZeroOrMore, "a new answer is blended in with this time constant at most");
  });
}

template <class Table>
void declare_handle_bounds(Table& limiter, Draft& draft) {
  limiter.table("rotation", [&draft](Table& keys) {
    constexpr Absent kMotors{.text = "required of a device with motors that turn its handle"};
    keys.key("coulomb_friction_nm", draft.rotation_bounds.coulomb, kZeroOrMore,
             "lower bound of the Coulomb friction of the device's rotation", kMotors);
    keys.key("viscous_friction_nm_s_per_rad", draft.rotation_bounds.viscous, kZeroOrMore,
             "lower bound of the viscous friction of the device's rotation", kMotors);
    keys.key("most_rad_per_s2", draft.rotation.most_acceleration, kAboveZero,
             "for bounded_acceleration: the largest angular acceleration of the handle",
             Absent{.text = "required with bounded_acceleration"});
    keys.key("shaping_stiffness_nm_per_rad", draft.rotation.shaping_stiffness, kAboveZero,
             "for shaping: no object is shown stiffer than this to a hand that turns",
             Absent{.text = "required with shaping"});
    keys.key("damping_nm_s_per_rad", draft.rotation.damping, kZeroOrMore,
             "for damper: what a vibration of the turning is damped with; 0: it is not");
  });
  limiter.table("gripper", [&draft](Table& keys) {
    constexpr Absent kMotor{.text = "required of a device whose gripper has a motor"};
    keys.key("coulomb_friction_n", draft.grip_bounds.coulomb, kZeroOrMore,
             "lower bound of the gripper's Coulomb friction, at the fingers", kMotor);
    keys.key("viscous_friction_n_s_per_m", draft.grip_bounds.viscous, kZeroOrMore,
             "lower bound of the gripper's viscous friction, at the fingers", kMotor);
  });
}

/// Declares the keys that are only used by some of the laws.
template <class Table>
void declare_law(Table& limiter, Draft& draft) {
  LimiterConfig& config = draft.scene.loop.control.limiter;
  const auto used_by = [&config](std::initializer_list<Law> users) {
    return Table::kDocuments || std::find(users.begin(), users.end(), config.law) != users.end();
  };
  if (used_by({Law::kClamp})) {
    limiter.key("clamp_n", config.max_force, kZeroOrMore, "for \"clamp\": no force is longer than this", kRequired);
  }
  if (used_by({Law::kReferenceEnergy, Law::kPortHamiltonian, Law::kPassiveSynthesis})) {
    limiter.key(
        "environment_stiffness_n_per_m", config.environment_stiffness, kAboveZero,
        "for \"reference-energy\", \"port-hamiltonian\", \"passive-synthesis\": the stiffness of an environment that "
        "sends none",
        Absent{.required = info(config.law).needs_stiffness,
               .text = "required; \"passive-synthesis\" can do without, and learns it from forces that bring one"});
  }
  if (used_by({Law::kPassiveSynthesis})) {
    limiter.key("environment_delay_ms", config.environment_delay, kZeroOrMore,
                "for \"passive-synthesis\": the time from a position to the force that answers it");
  }
  if (used_by({Law::kPassivityController, Law::kPassivityControllerPublished, Law::kReferenceEnergy})) {
    limiter.key("max_damping_n_s_per_m", config.max_damping, kAboveZero,
                "for \"tdpa\", \"tdpa-2002\", \"reference-energy\": the most damping that is injected. Far below twice "
                "the device's mass over the period");
  }
  if (used_by({Law::kAolPlus})) declare_parts(limiter, draft);
}

/// From 100 µs to 4 ms. At 4 ms, the stiffest wall that felt clean was 0.325 N/mm (Choi and Tan, IROS 2004). The
/// wake-up latency of an ordinary kernel is about 100 µs.
constexpr Number kPeriod{.least = 100, .most = 4000};
/// The maximum number in the cpu_set_t of the kernel.
constexpr Count kProcessor{1023};
/// The timeouts in the protocol are in ms.
constexpr Number kTimeout{.least = 1, .most = limits::kMaxTimeout / std::chrono::milliseconds(1)};
/// Each observer requires 250 bytes per haptic step. For 1000 observers, this is 2 Gbit/s at 1 kHz.
constexpr Count kObservers{1000};
constexpr Count kNetworkThreads{kMostDevices / limits::kMaxDevices, 1};

}  // namespace

template <class Table>
void declare_scene(Table& scene, Draft& draft) {
  scene.table("device", [&draft](Table& device) { declare_device(device, draft); });

  scene.table("loop", [&draft](Table& loop) {
    loop.key("period_us", draft.scene.loop.period, kPeriod, "from one haptic step to the next");
    loop.key("longest_hold_us", draft.longest_hold, kAboveZero,
             "T_max of the limiter: a force held for longer is an overrun. Not below the period",
             Absent{.text = "2 periods"});
    loop.key(
        "hold_memory_ms", draft.follow_holds.memory, kZeroOrMore,
        "time constant with which the limiter forgets a hold longer than longest_hold_us; until then it counts on one "
        "more like it. 0: it never counts on one");
    loop.key("hold_margin", draft.follow_holds.margin, Number{.least = 0, .most = 10},
             "how much longer than that hold, as a share of it, the next one may be");
    loop.key("hold_most", draft.follow_holds.most, Number{.least = 1, .most = 1000},
             "the longest hold that it counts on, as a multiple of longest_hold_us");
    loop.key(
        {"max_speed_m_per_s", "a position that no hand can reach is a fault"}, draft.scene.loop.control.max_speed,
        kAboveZero,
        "a position further away than a hand can move at this speed is a fault: the encoder has wrapped or lost count",
        Absent{.text = "every position is believed"});
    loop.key("cpu", draft.scene.cpu, kProcessor, "the processor on which the haptic thread stays: an isolated one",
             Absent{.text = "wherever the kernel puts it"});
  });

  scene.part({"safety", "no force unless armed, and none after a fault"}, draft.scene.safety,
             [](Table& safety, SafeDevice::Config& config) { declare_safety(safety, config); });

  scene.table("limiter", [&draft](Table& limiter) {
    LimiterConfig& config = draft.scene.loop.control.limiter;
    constexpr Absent kProfiles{.text = "the profile's; required without a profile, unless kind is \"none\""};
    limiter.key({"kind", "keeps the device from giving out energy"}, config.law, law_names(),
                "keeps the device from giving out energy. \"none\" is for simulated devices only");
    limiter.key("coulomb_friction_n", draft.coulomb_bound, kZeroOrMore,
                "lower bound of the device's Coulomb friction (aol-per-axis, aol-box: of each axis by itself)",
                kProfiles);
    limiter.key("viscous_friction_n_s_per_m", draft.viscous_bound, kZeroOrMore,
                "lower bound of the device's viscous friction", kProfiles);
    limiter.key(
        "preset", draft.preset, preset_names(),
        "for \"aol+\": lists the parts below that the scene does not list, and force.learned_model, with values "
        "that were measured together. " +
            preset_meanings());
    declare_handle_bounds(limiter, draft);
    declare_law(limiter, draft);
  });

  const Name admittance{"admittance", "the handle follows a tool of another mass"};
  scene.part(admittance, draft.scene.loop.control.admittance, [](Table& keys, AdmittanceLoop<3>::Config& tool) {
    // The values are the same for all axes.
    const auto each = [&keys](const char* name, Vec3& target, const Number& rule, const char* meaning, Absent absent) {
      double value = target.x();
      keys.key(name, value, rule, meaning, absent);
      target.setConstant(value);
    };
    tool.mass.setZero();
    tool.proportional.setZero();
    each("mass_kg", tool.mass, kAboveZero, "mass of the tool that the hand feels", kRequired);
    each("damping_n_s_per_m", tool.damping, kZeroOrMore, "damping of the tool", {});
    each("stiffness_n_per_m", tool.stiffness, kZeroOrMore, "ties the tool to where it was at the start", {});
    each("proportional_n_s_per_m", tool.proportional, kZeroOrMore, "gain of the loop that makes the handle follow",
         kRequired);
    each("integral_n_per_m", tool.integral, kZeroOrMore, "its integral gain", {});
  });

  scene.table("force", [&draft](Table& force) {
    HapticController::Config& control = draft.scene.loop.control;
    force.key("max_force_n", draft.max_force, kAboveZero, "no force is longer than this",
              Absent{.text = "the device's; required when the device has none, " + digits(kUnfelt) +
                             " N when it exerts no forces"});
    force.key("max_slew_n_per_s", control.max_slew, kAboveZeroOrInf, "no force changes faster than this");
    force.key("max_torque_nm", draft.max_torque, kAboveZero,
              "no torque is longer than this; a wrench keeps its direction", Absent{.text = "the device's"});
    force.key("max_torque_slew_nm_per_s", draft.rotation.max_slew, kAboveZeroOrInf,
              "no torque changes faster than this");
    force.key("max_angular_stiffness_nm_per_rad", control.hold.max_angular_stiffness, kAboveZero,
              "the stiffest model of rotation that is followed between two answers");
    force.key("max_grip_n", draft.max_grip, kAboveZero, "no force on the gripper's fingers is larger than this",
              Absent{.text = "the device's"});
    force.key("hold_ms", control.hold.hold, kZeroOrMore, "a force is held for this long after its validity ends");
    force.key("decay_ms", control.hold.decay, kAboveZero, "time constant of its fading after that");
    force.key("safe_stop_ms", control.hold.safe_stop, kZeroOrMore,
              "zero force this long after validity ends. Not below hold_ms");
    force.key("ramp_in_ms", control.hold.ramp_in, kZeroOrMore, "the first force is ramped in for this long");
    force.key("max_valid_for_ms", control.hold.max_valid_for, kAboveZero,
              "a force is valid for no longer than this, whatever its sender asks for");
    force.key("max_stiffness_n_per_m", control.hold.max_stiffness, kAboveZero,
              "the stiffness of an engine's local model is reduced to this");
    declare_between(force, control.hold);
  });

  scene.tables("channel", draft.scene.channels, limits::kMaxChannels, [](Table& keys, Scene::Channel& channel) {
    keys.key("name", channel.name, Label{}, "the name by which clients ask for this channel", kRequired);
    keys.key(
        "rule", channel.rule, Names<ChannelRule>{{{"sum", ChannelRule::kSum}, {"priority", ChannelRule::kPriority}}},
        "sum: its force is added to the others. Priority: while its force is fresh, the later channels of this rule "
        "are silent; it is faded in and out for ramp_in_ms");
    keys.key("lease_ms", channel.lease, Number{.least = 0, .most = limits::kMaxTimeout / std::chrono::milliseconds(1)},
             "after so long without a force another client may take it from its holder; 0: the holder keeps it until "
             "it leaves");
  });

  declare_teleoperation(scene, draft);

  scene.table("network", [&draft](Table& keys) {
    Scene::Network& network = draft.scene.network;
    keys.key("listen", network.listen, NetworkAddress{},
             "port 0 lets the system choose one. Without keys a loopback address");
    keys.key(
        "unix", network.unix_path, Path{},
        "file of a socket for engines on this machine, which come in by --server unix:PATH; its user and group may. "
        "Relative to the current directory, at most 107 bytes");
    keys.key("keys", network.keys, Path{},
             "folder with a file NAME.key for each client, relative to this file; only they are let in");
    keys.key("suites", network.suites, ListOf<Names<Suite>>{suite_names()},
             "by which those with a key may seal their sessions; the fastest that both ends and their processors have "
             "is taken. Leave one out to forbid it");
    keys.key("max_observers", network.max_observers, kObservers,
             "guests besides the controller, of each network thread");
    keys.key("controller_timeout_ms", network.controller_timeout, kTimeout, "a controller silent for so long has left");
    keys.key("observer_timeout_ms", network.observer_timeout, kTimeout, "an observer silent for so long has left");
    keys.key("adapt_state_rate", network.adapt_state_rate, YesNo{},
             "sends fewer states to a guest whose network is full, down to 1 in 20");
    keys.key("takeover", network.takeover, ListOf<Label>{},
             "names of the keys (without keys: of the clients) that may take a channel from its holder at once");
    keys.key("busy", network.busy, YesNo{},
             "its thread never sleeps: a datagram is read some 10 to 50 µs sooner, and a whole processor is taken all "
             "the time. Refused on a machine of one");
    keys.key("threads", network.threads, kNetworkThreads,
             "that share the devices by banks of 16: a power of two, and 1 with busy, with unix or where a scene dials",
             Absent{.text = "one for each 128 devices, where there are processors"});
  });

  scene.part("discovery", draft.scene.discovery, [](Table& keys, Scene::Discovery& discovery) {
    keys.key("announce", discovery.announce, YesNo{},
             "announces this device on the local network by DNS-SD, service _tendon._udp, where avahi-daemon runs; "
             "clients find it by --server dns-sd:NAME. Whoever listens learns that it is there; only a key lets in",
             kRequired);
    keys.key("name", discovery.name, InstanceName{}, "the NAME of that. A taken one is followed by \"NAME #2\"",
             Absent{.text = "\"DEVICE at HOST\", of this device and this machine"});
  });

  scene.part("recording", draft.scene.recording, [](Table& keys, Scene::Recording& recording) {
    keys.key(
        "path", recording.path, Path{},
        "MCAP file, relative to the current directory. A file that is there is never overwritten: run.mcap goes on "
        "as run-2.mcap, run-3.mcap",
        kRequired);
    keys.key("rotate_mb", recording.rotate_bytes, Number{.least = 4, .most = 4000},
             "a file that has grown to this size is followed by the next number");
    keys.key("rotate_min", recording.rotate_after, Number{.least = 1, .most = 240},
             "a file of this age is followed by the next number");
    keys.key(
        "budget_mb", recording.budget_bytes, Number{.least = 16, .most = 1e9},
        "keeps all files of this name that have a budget within it: the oldest are deleted, but never a fault's. One "
        "file takes at most a quarter of it",
        Absent{.text = "nothing is deleted"});
    keys.key(
        "keep", recording.keep, Names<Keep>{{{"all", Keep::kAll}, {"faults", Keep::kFaults}}},
        "which files stay. faults: a file takes a minute at most, and stays only when it has a part of the time from "
        "60 s before a device's fault to 10 s after its beginning; the others are deleted");
    keys.key("one_in", recording.one_in, Count{1'000'000, 1},
             "with keep = \"faults\": of this many files the first stays in any case",
             Absent{.text = "none stays without a fault"});
    keys.key("datagrams_kb_per_s", recording.datagram_bytes_per_s, Number{.least = 1, .most = 1e6},
             "the most that is recorded of guests' datagrams; steps are always recorded");
  });
}

template void declare_scene(Reader&, Draft&);
template void declare_scene(Reference&, Draft&);
template void declare_scene(Parts&, Draft&);

}  // namespace tendon::scene_file
