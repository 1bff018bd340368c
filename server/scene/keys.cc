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

Names<std::optional<Dscp>> dscp_names() { return {{{"none", std::nullopt}, {"ef", Dscp::kExpedited}}}; }

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
      keys.key("radius_mm", sphere.radius, kAboveZero, "Radius of the workspace. Inside it, forces are not reduced",
               kRequired);
    } else {
      auto& box = config.shape.emplace<Workspace::Box>();
      keys.key("half_mm", box.half, Vector{},
               "Half the edge lengths of the workspace. Inside it, forces are not reduced", kRequired);
    }
    keys.key("centre_mm", config.centre, Vector{}, "Centre of the workspace");
    keys.key("margin_mm", config.margin, kAboveZero,
             "Distance outside the workspace at which no force pushes outwards any more", kRequired);
  });
}

template <class Table>
void declare_watchdog(Table& keys, Watchdog::Config& dog, std::string_view meaning) {
  keys.key("timeout_ms", dog.timeout, kAboveZero, meaning, kRequired);
  keys.key("ramp_ms", dog.ramp, kZeroOrMore, "Time in which the force then decreases to zero");
}

template <class Table>
void declare_safety(Table& safety, SafeDevice::Config& config) {
  using By = SafeDevice::Arming::By;
  safety.key("arm", config.arming.by,
             Names<By>{{{"by request", By::kRequest}, {"at start", By::kStart}, {"by dead man", By::kDeadMan}}},
             "Who arms the device. By request: a client, with a Rearm request. At start: the server when it starts, "
             "and a client after a fault. By dead man: the operator, with the dead man's button");
  safety.key("rest_speed_m_per_s", config.arming.rest_speed, kAboveZero,
             "Maximum speed of the handle for arming. The handle must not exceed it for 50 ms");
  safety.key("rest_force_n", config.arming.rest_force, kAboveZero, "Maximum requested force for arming");
  safety.key("rest_torque_nm", config.arming.rest_torque, kAboveZero, "Maximum requested torque for arming");
  safety.key("patience_ms", config.arming.patience, kAboveZero,
             "Time after which a Rearm request expires if the device could not be armed");
  safety.part({"force_limit", "limits the force"}, config.force_limit, [](Table& keys, auto& part) {
    keys.key("max_n", part.max, kAboveZero,
             "Maximum length of the force vector. A larger force is reduced to it, and keeps its direction", kRequired);
  });
  safety.part({"growth_limit", "limits how fast the force increases"}, config.growth_limit,
              [](Table& keys, auto& part) {
                keys.key("rate_n_per_s", part.rate, kAboveZero,
                         "Maximum rate at which the force increases. It may decrease at once", kRequired);
              });
  safety.part({"ramp_in", "increases the force slowly after arming"}, config.ramp_in, [](Table& keys, auto& part) {
    keys.key("time_ms", part.time, kAboveZero, "Time from arming to the full force, which increases from zero",
             kRequired);
  });
  safety.part({"heat_limit", "keeps the motors from overheating"}, config.heat_limit, [](Table& keys, auto& part) {
    keys.key("peak_n", part.peak, kAboveZero, "Maximum force while the motors are cold", kRequired);
    keys.key("continuous_n", part.continuous, kAboveZero, "Maximum continuous force of the motors, at most peak_n",
             kRequired);
    keys.key("time_constant_ms", part.time_constant, kAboveZero, "Thermal time constant of the motors", kRequired);
  });
  safety.part({"workspace", "removes forces that push the hand out of the workspace"}, config.workspace,
              [](Table& keys, auto& part) { declare_workspace(keys, part); });
  safety.part(
      {"speed_trip", "removes the force if the handle moves too fast"}, config.speed_trip, [](Table& keys, auto& part) {
        keys.key("max_m_per_s", part.max, kAboveZero,
                 "Maximum speed of the handle. A higher speed is a fault: no force until the device is armed again",
                 kRequired);
      });
  safety.part({"step_bound", "disarms the device if an encoder wraps around or loses counts"}, config.step_bound,
              [](Table& keys, auto& part) {
                keys.key("max_speed_m_per_s", part.max_speed, kAboveZero,
                         "Maximum speed of a hand. A position that requires a higher speed is a fault", kRequired);
              });
  safety.part({"command_watchdog", "removes the force if the control loop stops"}, config.command_watchdog,
              [](Table& keys, auto& part) { declare_watchdog(keys, part, "Maximum time between two force commands"); });
  safety.part({"link_watchdog", "removes the force if the device stops sending positions"}, config.link_watchdog,
              [](Table& keys, auto& part) { declare_watchdog(keys, part, "Maximum age of the newest position"); });
  safety.part({"dead_man", "allows forces only while a button is held"}, config.dead_man, [](Table& keys, auto& part) {
    keys.key("button", part.button, Count{31}, "Number of the button that must be held for any force", kRequired);
  });
  safety.part({"torque_limit", "limits the torque"}, config.torque_limit, [](Table& keys, auto& part) {
    keys.key("max_nm", part.max, kAboveZero,
             "Maximum length of the torque vector. A larger torque is reduced to it, and the force by the same factor: "
             "a wrench keeps its direction",
             kRequired);
  });
  safety.part({"torque_growth_limit", "limits how fast the torque increases"}, config.torque_growth_limit,
              [](Table& keys, auto& part) {
                keys.key("rate_nm_per_s", part.rate, kAboveZero,
                         "Maximum rate at which the torque increases; the force increases no faster in proportion. The "
                         "torque may decrease at once",
                         kRequired);
              });
  safety.part(
      {"turn_trip", "removes the force if the handle turns too fast"}, config.turn_trip, [](Table& keys, auto& part) {
        keys.key(
            "max_deg_per_s", part.max, kAboveZero,
            "Maximum angular speed of the handle. A higher speed is a fault: no force until the device is armed again",
            kRequired);
      });
  safety.part({"grip_limit", "limits the force on the fingers"}, config.grip_limit, [](Table& keys, auto& part) {
    keys.key("max_n", part.max, kAboveZero, "Maximum force on the fingers. A larger force is reduced to it", kRequired);
  });
  safety.part({"grip_growth_limit", "limits how fast the force on the fingers increases"}, config.grip_growth_limit,
              [](Table& keys, auto& part) {
                keys.key("rate_n_per_s", part.rate, kAboveZero,
                         "Maximum rate at which the force on the fingers increases. It may decrease at once",
                         kRequired);
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
    keys.key("energy_mj", cap.energy, kZeroOrMore,
             "Maximum credit that remains after the contact in which it was earned");
    keys.key("most_contact_mj", cap.most_contact, kZeroOrMore, "Maximum credit that one contact may add");
  });
  declare(&Plus::Parts::robust_ledger, [&draft](Table& keys, Plus::Robust& robust) {
    keys.key("encoder_step_um", draft.ledger_step, kZeroOrMore,
             "One encoder count. Rounding to a count never earns credit",
             Absent{.text = "that of the device; required if the device has none"});
    keys.key("window", robust.window, Count{1000, 1},
             "Number of haptic periods over which viscous friction is credited");
  });
  declare(&Plus::Parts::knee, [](Table& keys, Plus::Knee& knee) {
    keys.key("start", knee.start, Number{.least = 0.01, .most = 0.99},
             "Share of the permitted force above which forces are compressed instead of clipped");
  });
  declare(&Plus::Parts::latency_reserve, [](Table& keys, Plus::LatencyReserve& reserve) {
    keys.key("holds", reserve.holds, Count{Plus::kMostHolds, 1},
             "Number of periods between the choice of a force and its start at the device. Not allowed with "
             "bounded_acceleration");
  });
  declare(&Plus::Parts::bounded_acceleration, [](Table& keys, Plus::BoundedAcceleration& bounded) {
    keys.key("most_m_per_s2", bounded.most[0], kAboveZero,
             "Maximum acceleration of the handle: the largest sum of the forces of hand and motors, divided by the "
             "apparent mass");
  });
  declare(&Plus::Parts::shaping, [](Table& keys, Plus::Shaping& shaping) {
    keys.key("stiffness_n_per_m", shaping.stiffness[0], kAboveZero,
             "Maximum rendered stiffness. Stiffer objects are rendered with this stiffness");
  });
  declare(&Plus::Parts::adaptive_friction, [&draft](Table& keys, Plus::AdaptiveFriction& adaptive) {
    keys.key("rise_ms", adaptive.rise, kAboveZero,
             "Time constant with which the bounds increase. They decrease at once");
    keys.key("places_mm", draft.places, ListOf<Vector>{}, "Positions at which the friction was identified", kRequired);
    keys.key("coulomb_friction_n", draft.place_coulomb, ListOf<Number>{kZeroOrMore},
             "Lower bound of the Coulomb friction at each position", kRequired);
    keys.key("viscous_friction_n_s_per_m", draft.place_viscous, ListOf<Number>{kZeroOrMore},
             "Lower bound of the viscous friction at each position", kRequired);
    keys.key("reach_mm", draft.friction_map.reach, kZeroOrMore,
             "The limiter uses the lowest bound of the nearest position and of all positions within this distance of "
             "the hand");
  });
  declare(&Plus::Parts::thrift, [](Table& keys, Plus::Thrift& thrift) {
    keys.key("share", thrift.share, Number{.least = 0.01, .most = 1},
             "Maximum share of a force that is held back while the force does work on the hand");
    keys.key("energy_mj", thrift.energy, kAboveZero, "Credit above which nothing is held back");
  });
  declare(&Plus::Parts::damper, [](Table& keys, Plus::Damper& damper) {
    keys.key("damping_n_s_per_m", damper.viscous[0], kAboveZero, "Damping of a vibration of the hand in contact");
    keys.key("smoothing_ms", damper.smoothing, kAboveZero, "Time constant of each of the two velocity filters");
    keys.key("slow_ms", damper.slow, kAboveZero,
             "Time constant that separates motion from vibration. Slower motion is not damped");
    keys.key("dead_zone", damper.dead_zone, kZeroOrMore,
             "Dead zone, in velocity pulses of one encoder count. Smaller motion is not damped");
  });
  declare(&Plus::Parts::fading_contact, [](Table& keys, Plus::FadingContact& fading) {
    keys.key("memory_ms", fading.memory, kAboveZero,
             "For energy_cap: time constant with which the credit of a finished contact decays");
  });
}

Names<OutputEstimator::Model> estimator_models() {
  using enum OutputEstimator::Model;
  return {{{"polynomial", kPolynomial}, {"spring-and-bias", kSpringAndBias}, {"output-error", kOutputError}}};
}

/// At most one of these tables is allowed.
template <class Table>
void declare_between(Table& force, HeldForce::Config& hold) {
  const Name model{"adaptive_local_model", "blends and limits the local models of the engine"};
  force.part(model, hold.adaptive_local_model, [](Table& keys, AdaptiveLocalModel::Config& config) {
    keys.key("share", config.share, Number{.least = 0.01, .most = 1},
             "Share of the engine's stiffness that is used. Below 1 if the engine only estimates the stiffness");
    keys.key("max_blend_ms", config.max_blend, kAboveZero,
             "Maximum time for blending to a new model. It is blended in over one period of the engine");
  });
  const Name estimator{"output_estimator", "estimates the environment from its forces"};
  force.part(estimator, hold.output_estimator, [](Table& keys, OutputEstimator::Config& config) {
    keys.key("model", config.model, estimator_models(), "Model of the environment on each axis");
    keys.key("origin_mm", config.origin, Vector{}, "Rest position of the environment");
    keys.key("scale_mm", config.scale, kAboveZero, "Approximate travel of the hand in the environment");
    keys.key("forgetting", config.forgetting, Number{.least = 0.5, .most = 1},
             "Factor by which each answer reduces the weight of earlier answers");
    keys.key("dead_zone_n", config.dead_zone, kZeroOrMore, "Errors up to this size are treated as noise of the engine");
    keys.key("reset_error_n", config.reset_error, kAboveZero,
             "Error above which the environment has changed and the estimate is reset");
    keys.key("reset_cooldown", config.reset_cooldown, Count{1000, 1}, "Minimum number of answers between two resets");
    keys.key("max_stiffness_n_per_m", config.max_stiffness, kAboveZero,
             "Maximum estimated stiffness of the environment");
    keys.key("largest_n", config.max_force, kAboveZero, "Maximum estimated force on each axis");
    keys.key("resolution_um", config.resolution, kZeroOrMore, "One encoder count. Smaller motion is not used");
  });
  const Name learned{"learned_model", "extrapolates each answer to the current position of the hand"};
  force.part(learned, hold.learned_model, [](Table& keys, LearnedModel::Config& config) {
    keys.key("least_travel_um", config.least_travel, kAboveZero,
             "Minimum travel of the hand for an update of the model");
    keys.key("gain", config.gain, Number{.least = 0.01, .most = 1}, "Share of an error that one update corrects");
    keys.key("forgetting", config.forgetting, Number{.least = 0.5, .most = 0.999},
             "Factor by which each update reduces the weight of earlier updates in the confidence of the model");
    keys.key("max_stiffness_n_per_m", config.max_stiffness, kAboveZero,
             "Maximum estimated stiffness of the environment");
    keys.key("blend_ms", config.blend, kZeroOrMore, "Maximum time constant for blending to a new answer");
  });
}

template <class Table>
void declare_handle_bounds(Table& limiter, Draft& draft) {
  limiter.table("rotation", [&draft](Table& keys) {
    constexpr Absent kMotors{.text = "required if the device has motors that turn its handle"};
    keys.key("coulomb_friction_nm", draft.rotation_bounds.coulomb, kZeroOrMore,
             "Lower bound of the Coulomb friction of the device's rotation", kMotors);
    keys.key("viscous_friction_nm_s_per_rad", draft.rotation_bounds.viscous, kZeroOrMore,
             "Lower bound of the viscous friction of the device's rotation", kMotors);
    keys.key("most_rad_per_s2", draft.rotation.most_acceleration, kAboveZero,
             "For bounded_acceleration: maximum angular acceleration of the handle",
             Absent{.text = "required with bounded_acceleration"});
    keys.key("shaping_stiffness_nm_per_rad", draft.rotation.shaping_stiffness, kAboveZero,
             "For shaping: maximum rendered angular stiffness", Absent{.text = "required with shaping"});
    keys.key("damping_nm_s_per_rad", draft.rotation.damping, kZeroOrMore,
             "For damper: damping of an angular vibration. 0: no damping");
  });
  limiter.table("gripper", [&draft](Table& keys) {
    constexpr Absent kMotor{.text = "required if the gripper has a motor"};
    keys.key("coulomb_friction_n", draft.grip_bounds.coulomb, kZeroOrMore,
             "Lower bound of the gripper's Coulomb friction, at the fingers", kMotor);
    keys.key("viscous_friction_n_s_per_m", draft.grip_bounds.viscous, kZeroOrMore,
             "Lower bound of the gripper's viscous friction, at the fingers", kMotor);
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
    limiter.key("clamp_n", config.max_force, kZeroOrMore, "For \"clamp\": maximum length of the force vector",
                kRequired);
  }
  if (used_by({Law::kReferenceEnergy, Law::kPortHamiltonian, Law::kPassiveSynthesis})) {
    limiter.key(
        "environment_stiffness_n_per_m", config.environment_stiffness, kAboveZero,
        "For \"reference-energy\", \"port-hamiltonian\", \"passive-synthesis\": stiffness of an environment that does "
        "not send one",
        Absent{.required = info(config.law).needs_stiffness,
               .text = "required; optional for \"passive-synthesis\", which learns the stiffness from forces that "
                       "include one"});
  }
  if (used_by({Law::kPassiveSynthesis})) {
    limiter.key("environment_delay_ms", config.environment_delay, kZeroOrMore,
                "For \"passive-synthesis\": time from a position to the force that answers it");
  }
  if (used_by({Law::kPassivityController, Law::kPassivityControllerPublished, Law::kReferenceEnergy})) {
    limiter.key("max_damping_n_s_per_m", config.max_damping, kAboveZero,
                "For \"tdpa\", \"tdpa-2002\", \"reference-energy\": maximum injected damping. Choose it far below "
                "twice the device's mass divided by the period");
  }
  if (used_by({Law::kAolPlus})) declare_parts(limiter, draft);
}

/// From 100 µs to 4 ms. At 4 ms, the stiffest wall that still felt clean had 0.325 N/mm (Choi and Tan, IROS 2004). The
/// wake-up latency of an ordinary kernel is about 100 µs.
constexpr Number kPeriod{.least = 100, .most = 4000};
constexpr Count kProcessor{1023};  ///< the maximum number in the cpu_set_t of the kernel
/// The protocol has timeouts in ms.
constexpr Number kTimeout{.least = 1, .most = limits::kMaxTimeout / std::chrono::milliseconds(1)};
/// Each observer requires 250 bytes per haptic step. For 1000 observers, this is 2 Gbit/s at 1 kHz.
constexpr Count kObservers{1000};
/// A client can use half of the cache, which must store at least one field of BrickField::kMostBricks bricks.
constexpr Number kFieldCache{.least = 4, .most = 1000};
constexpr Count kNetworkThreads{kMostDevices / limits::kMaxDevices, 1};

}  // namespace

template <class Table>
void declare_scene(Table& scene, Draft& draft) {
  scene.table("device", [&draft](Table& device) { declare_device(device, draft); });

  scene.table("loop", [&draft](Table& loop) {
    loop.key("period_us", draft.scene.loop.period, kPeriod, "Time from one haptic step to the next");
    loop.key("longest_hold_us", draft.longest_hold, kAboveZero,
             "T_max of the limiter. If a force is held for longer, this is an overrun. At least the period",
             Absent{.text = "2 periods"});
    loop.key("hold_memory_ms", draft.follow_holds.memory, kZeroOrMore,
             "Time constant with which the limiter forgets a hold that was longer than longest_hold_us. Until then, it "
             "expects another one. 0: it never expects one");
    loop.key("hold_margin", draft.follow_holds.margin, Number{.least = 0, .most = 10},
             "Margin for the expected hold, as a share of the longest observed hold");
    loop.key("hold_most", draft.follow_holds.most, Number{.least = 1, .most = 1000},
             "Maximum expected hold, as a multiple of longest_hold_us");
    loop.key({"max_speed_m_per_s", "detects positions that no hand can reach"}, draft.scene.loop.control.max_speed,
             kAboveZero,
             "Maximum speed of a hand. A position that requires a higher speed is a fault: the encoder has wrapped "
             "around or lost counts",
             Absent{.text = "every position is accepted"});
    loop.key("cpu", draft.scene.cpu, kProcessor,
             "Number of the processor on which the haptic thread runs, preferably an isolated one",
             Absent{.text = "chosen by the kernel"});
  });

  scene.part({"safety", "allows forces only while the device is armed"}, draft.scene.safety,
             [](Table& safety, SafeDevice::Config& config) { declare_safety(safety, config); });

  scene.table("limiter", [&draft](Table& limiter) {
    LimiterConfig& config = draft.scene.loop.control.limiter;
    constexpr Absent kProfiles{.text = "that of the profile; without a profile, required unless kind is \"none\""};
    limiter.key({"kind", "keeps the device from generating energy"}, config.law, law_names(),
                "Control law that keeps the device from generating energy. \"none\" is for simulated devices only");
    limiter.key("coulomb_friction_n", draft.coulomb_bound, kZeroOrMore,
                "Lower bound of the device's Coulomb friction (aol-per-axis, aol-box: of each axis)", kProfiles);
    limiter.key("viscous_friction_n_s_per_m", draft.viscous_bound, kZeroOrMore,
                "Lower bound of the device's viscous friction", kProfiles);
    limiter.key("preset", draft.preset, preset_names(),
                "For \"aol+\": adds the parts below that the scene does not list, and force.learned_model, with values "
                "that were tested together. " +
                    preset_meanings());
    declare_law(limiter, draft);
    declare_handle_bounds(limiter, draft);
  });

  const Name admittance{"admittance", "makes the handle follow a virtual tool"};
  scene.part(admittance, draft.scene.loop.control.admittance, [](Table& keys, AdmittanceLoop<3>::Config& tool) {
    // The values are the same for all axes.
    const auto each = [&keys](const char* name, Vec3& target, const Number& rule, const char* meaning, Absent absent) {
      double value = target.x();
      keys.key(name, value, rule, meaning, absent);
      target.setConstant(value);
    };
    tool.mass.setZero();
    tool.proportional.setZero();
    each("mass_kg", tool.mass, kAboveZero, "Mass of the virtual tool that the hand feels", kRequired);
    each("damping_n_s_per_m", tool.damping, kZeroOrMore, "Damping of the virtual tool", {});
    each("stiffness_n_per_m", tool.stiffness, kZeroOrMore,
         "Stiffness of a spring from the virtual tool to its initial position", {});
    each("proportional_n_s_per_m", tool.proportional, kZeroOrMore,
         "Proportional gain of the loop that makes the handle follow the tool", kRequired);
    each("integral_n_per_m", tool.integral, kZeroOrMore, "Integral gain of this loop", {});
  });

  scene.table("force", [&draft](Table& force) {
    HapticController::Config& control = draft.scene.loop.control;
    force.key("max_force_n", draft.max_force, kAboveZero, "Maximum length of the force vector",
              Absent{.text = "that of the device; required if the device has none, " + digits(kUnfelt) +
                             " N when it exerts no forces"});
    force.key("max_slew_n_per_s", control.max_slew, kAboveZeroOrInf, "Maximum rate of change of the force");
    force.key("max_torque_nm", draft.max_torque, kAboveZero,
              "Maximum length of the torque vector. If it is reduced, the force is reduced as well: a wrench keeps its "
              "direction",
              Absent{.text = "that of the device"});
    force.key("max_torque_slew_nm_per_s", draft.rotation.max_slew, kAboveZeroOrInf,
              "Maximum rate of change of the torque");
    force.key("max_angular_stiffness_nm_per_rad", control.hold.max_angular_stiffness, kAboveZero,
              "Maximum angular stiffness of the local model that is used between two answers");
    force.key("max_grip_n", draft.max_grip, kAboveZero, "Maximum force on the fingers of the gripper",
              Absent{.text = "that of the device"});
    force.key("hold_ms", control.hold.hold, kZeroOrMore, "Time for which a force is held after its validity has ended");
    force.key("decay_ms", control.hold.decay, kAboveZero, "Time constant with which the force decays after that");
    force.key("safe_stop_ms", control.hold.safe_stop, kZeroOrMore,
              "Time after the end of the validity at which the force becomes zero. At least hold_ms");
    force.key("ramp_in_ms", control.hold.ramp_in, kZeroOrMore, "Time in which the first force is ramped up");
    force.key("max_valid_for_ms", control.hold.max_valid_for, kAboveZero,
              "Maximum validity of a force. A longer validity from a client is reduced to it");
    force.key("max_stiffness_n_per_m", control.hold.max_stiffness, kAboveZero,
              "Maximum stiffness of the engine's local model. A higher stiffness is reduced to it");
    declare_between(force, control.hold);
  });

  const Name field{"field", "renders objects that engines upload"};
  scene.part(field, draft.scene.loop.control.hold.field, [&draft](Table& keys, field::Renderer::Config& renderer) {
    Scene::Fields& fields = draft.scene.fields;
    keys.key("allow", fields.channels, ListOf<Label>{}, "Names of the channels that may use fields",
             Absent{.text = "all channels"});
    keys.key("max_stiffness_n_per_m", renderer.max_stiffness, kAboveZero,
             "Maximum stiffness of a material or a fixture. Stiffer ones are refused");
    keys.key("push_j", renderer.push.push_j, kZeroOrMore,
             "Energy that a moving object can give to the hand at once. 0: an object cannot push the hand");
    keys.key("push_w", renderer.push.push_w, kZeroOrMore, "Rate at which this energy is refilled, up to push_j");
    keys.key("cache_mb", fields.cache_bytes, kFieldCache,
             "Size of the cache for uploaded bricks, for each network thread. A client can use half of it");
  });

  scene.tables("channel", draft.scene.channels, limits::kMaxChannels, [](Table& keys, Scene::Channel& channel) {
    keys.key("name", channel.name, Label{}, "Name by which clients select this channel", kRequired);
    keys.key("rule", channel.rule,
             Names<ChannelRule>{{{"sum", ChannelRule::kSum}, {"priority", ChannelRule::kPriority}}},
             "Sum: the force is added to those of the other channels. Priority: while the force is fresh, later "
             "channels with this rule are ignored. Changes are faded over ramp_in_ms");
    keys.key("lease_ms", channel.lease, Number{.least = 0, .most = limits::kMaxTimeout / std::chrono::milliseconds(1)},
             "Time without a force after which another client may take the channel from its holder. 0: the holder "
             "keeps the channel until it leaves");
  });

  declare_teleoperation(scene, draft);

  scene.table("network", [&draft](Table& keys) {
    Scene::Network& network = draft.scene.network;
    keys.key("listen", network.listen, NetworkAddress{},
             "Address at which the server receives datagrams. Port 0: a free port. Without keys, this must be a "
             "loopback address");
    keys.key("unix", network.unix_path, Path{},
             "Unix socket for clients on this machine, which connect with --server unix:PATH. The owner and the group "
             "of the file have access. Relative to the current directory, at most 107 bytes");
    keys.key("keys", network.keys, Path{},
             "Folder with a file NAME.key for each client, relative to this file. Other clients are refused");
    keys.key("suites", network.suites, ListOf<Names<Suite>>{suite_names()},
             "Ciphers for sessions with a key. The fastest cipher that both ends support is used. Omit a cipher to "
             "disable it");
    keys.key("max_observers", network.max_observers, kObservers, "Maximum number of observers for each network thread");
    keys.key("controller_timeout_ms", network.controller_timeout, kTimeout,
             "Time without a datagram after which the session of a controller ends");
    keys.key("observer_timeout_ms", network.observer_timeout, kTimeout,
             "Time without a datagram after which the session of an observer ends");
    keys.key("adapt_state_rate", network.adapt_state_rate, YesNo{},
             "Send fewer states to a client if its network is congested, down to 1 in 20");
    keys.key("takeover", network.takeover, ListOf<Label>{},
             "Names of the keys (without keys: of the clients) that may take a channel from its holder at any time");
    keys.key("busy", network.busy, YesNo{},
             "Poll instead of sleeping. Datagrams are read about 10 to 50 µs earlier, but the network thread always "
             "uses a whole processor. Refused if there is only one processor");
    keys.key("dscp", network.dscp, dscp_names(),
             "Mark all datagrams of the server, so that routers and switches that are configured for it forward them "
             "first. ef: expedited forwarding (46)");
    keys.key("threads", network.threads, kNetworkThreads,
             "Number of network threads, which share the devices in banks of 16. A power of two; 1 with busy, with "
             "unix, or if a scene has teleoperation.dial",
             Absent{.text = "one for each 128 devices, at most the number of processors"});
  });

  scene.part("discovery", draft.scene.discovery, [](Table& keys, Scene::Discovery& discovery) {
    keys.key("announce", discovery.announce, YesNo{},
             "Announce this device on the local network by DNS-SD (service _tendon._udp) if avahi-daemon is running. "
             "Clients connect with --server dns-sd:NAME. The announcement is visible to everyone on the network, but "
             "only clients with a key can connect",
             kRequired);
    keys.key("name", discovery.name, InstanceName{},
             "The NAME in the announcement. If it is taken, \"NAME #2\" is used",
             Absent{.text = "\"DEVICE at HOST\", with the names of this device and this machine"});
  });

  scene.part("recording", draft.scene.recording, [](Table& keys, Scene::Recording& recording) {
    keys.key("path", recording.path, Path{},
             "MCAP file, relative to the current directory. Existing files are never overwritten: after run.mcap, "
             "run-2.mcap and run-3.mcap are written",
             kRequired);
    keys.key("rotate_mb", recording.rotate_bytes, Number{.least = 4, .most = 4000},
             "Size of a file after which the next file is started");
    keys.key("rotate_min", recording.rotate_after, Number{.least = 1, .most = 240},
             "Duration of a file after which the next file is started");
    keys.key("budget_mb", recording.budget_bytes, Number{.least = 16, .most = 1e9},
             "Maximum size of all files of this name that have a budget. The oldest files are deleted, except "
             "recordings of faults. One file has at most a quarter of this size",
             Absent{.text = "nothing is deleted"});
    keys.key("keep", recording.keep, Names<Keep>{{{"all", Keep::kAll}, {"faults", Keep::kFaults}}},
             "Which files are kept. faults: a file has at most one minute, and is deleted unless it overlaps with the "
             "time from 60 s before to 10 s after the start of a device's fault");
    keys.key("one_in", recording.one_in, Count{1'000'000, 1},
             "With keep = \"faults\": the first of this many files is always kept",
             Absent{.text = "no file is kept without a fault"});
    keys.key("datagrams_kb_per_s", recording.datagram_bytes_per_s, Number{.least = 1, .most = 1e6},
             "Maximum rate at which datagrams of clients are recorded. Steps are always recorded");
  });
}

template void declare_scene(Reader&, Draft&);
template void declare_scene(Reference&, Draft&);
template void declare_scene(Parts&, Draft&);

}  // namespace tendon::scene_file
