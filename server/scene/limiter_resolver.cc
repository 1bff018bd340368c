// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/control/aol_parts.h"
#include "core/control/preset.h"
#include "core/handle/handle_bounds.h"
#include "core/handle/turn_friction.h"
#include "server/scene/resolver.h"
#include "server/scene/values.h"

namespace tendon::scene_file {
namespace {

class LimiterResolver : SceneErrors {
 public:
  LimiterResolver(Draft& draft, const SceneErrors& errors) : SceneErrors(errors), draft_(draft) {}

  void resolve() const {
    HapticController::Config& control = draft_.scene.loop.control;
    const SimulatedDevice::Config& device = draft_.simulated;
    // Isotropic friction is smaller on a single axis because Σ f |dx_i| ≤ √3 f ‖dx‖ (core/PROOFS.md, "Several
    // coordinates").
    const bool per_axis = control.limiter.law == Law::kAolPerAxis || control.limiter.law == Law::kAolBox;
    const DeviceProfile* profile = draft_.profile;
    const Friction truth = least_friction(device);
    control.limiter.friction.coulomb =
        friction_bound("coulomb_friction_n", draft_.coulomb_bound, profile ? &profile->coulomb_bound : nullptr,
                       truth.coulomb, per_axis ? 1 / std::numbers::sqrt3 : 1);
    control.limiter.friction.viscous = friction_bound("viscous_friction_n_s_per_m", draft_.viscous_bound,
                                                      profile ? &profile->viscous_bound : nullptr, truth.viscous, 1);
    resolve_parts(control.limiter);
    resolve_preset(control);
    resolve_places(control);
    resolve_rotation(control);
    resolve_grip(control);
    if (control.rotation || control.grip) build("limiter", [&control] { HapticController{control}; });
  }

 private:
  /// Required if the device has these motors, because the limiter must limit all torques.
  void resolve_rotation(HapticController::Config& control) const {
    const auto& device = draft_.simulated.rotation;
    const bool motors = device && device->max_torque;
    const Friction friction = handle_friction(
        motors, draft_.rotation_bounds,
        {"limiter.rotation.coulomb_friction_nm", "limiter.rotation.viscous_friction_nm_s_per_rad"},
        device ? Friction{device->coulomb_friction.value_or(0), device->viscous_friction.value_or(0)} : Friction{},
        "motors that turn its handle", kTurnFrictionShare);
    if (!motors) return;
    RotationLimits& limits = control.rotation.emplace(draft_.rotation);
    limits.friction = friction;
    limits.max_torque = draft_.max_torque.value_or(*device->max_torque);
    limits.encoder_step = device->encoder_step.value_or(0);
  }

  void resolve_grip(HapticController::Config& control) const {
    const auto& device = draft_.simulated.gripper;
    const bool motor = device && device->max_force;
    const Friction friction = handle_friction(
        motor, draft_.grip_bounds, {"limiter.gripper.coulomb_friction_n", "limiter.gripper.viscous_friction_n_s_per_m"},
        device ? Friction{device->coulomb_friction.value_or(0), device->viscous_friction.value_or(0)} : Friction{},
        "a motor that closes its gripper");
    if (!motor) return;
    control.grip =
        GripLimits{.friction = friction, .arm = device->arm, .max_force = draft_.max_grip.value_or(*device->max_force)};
  }

  /// `truth` is the friction of the simulated device. Only the fraction `share` of its viscous friction is used.
  Friction handle_friction(bool has_motor, const Draft::FrictionBounds& given, const std::array<std::string, 2>& keys,
                           const Friction& truth, const std::string& motor, double share = 1) const {
    const Law law = draft_.scene.loop.control.limiter.law;
    if (has_motor && law != Law::kAolPlus && law != Law::kAol && law != Law::kNone) {
      blame("limiter.kind", {},
            "expected \"aol+\", \"aol\" or \"none\": the other laws only limit the force on a point, and this device "
            "has " +
                motor);
    }
    const auto bound = [&](const std::optional<double>& value, const std::string& key, double true_size, double of_it) {
      const double most = of_it * true_size;
      if (!has_motor && value)
        blame(key, {}, "expected a device with " + motor + ", because this is a bound on its friction");
      if (has_motor && !value && law != Law::kNone) {
        blame(key, {}, "missing, expected " + kZeroOrMore.expected(unit_of(key)) + ", because the device has " + motor);
      }
      if (value && *value > most) {
        blame(key, {},
              "expected at most " + with_symbol(digits(most), unit_of(key)) + (of_it < 1 ? ", 98 % of" : ",") +
                  " the true friction of the simulated device, because a higher bound voids the limiter's proof, "
                  "found " +
                  digits(*value));
      }
      return value.value_or(0);
    };
    return {.coulomb = bound(given.coulomb, keys[0], truth.coulomb, 1),
            .viscous = bound(given.viscous, keys[1], truth.viscous, share)};
  }

  void resolve_places(HapticController::Config& control) const {
    if (!control.limiter.parts.adaptive_friction) return;
    const std::string table = "limiter.adaptive_friction";
    const std::size_t count = draft_.places.size();
    if (draft_.place_coulomb.size() != count || draft_.place_viscous.size() != count) {
      blame(table + ".places_mm", {},
            "expected one place for each value of coulomb_friction_n and of viscous_friction_n_s_per_m");
    }
    const SimulatedDevice::Config& device = draft_.simulated;
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
    if (!draft_.scene.driver().moves_a_hand && draft_.scene.driver().exerts_force) {  // only known for simulations
      check("coulomb_friction_n", draft_.place_coulomb, &Friction::coulomb);
      check("viscous_friction_n_s_per_m", draft_.place_viscous, &Friction::viscous);
    }
    for (std::size_t i = 0; i < count; ++i) {
      refuse_impossible(table + ".coulomb_friction_n", draft_.place_coulomb[i], kMovementBounds.friction.coulomb);
      refuse_impossible(table + ".viscous_friction_n_s_per_m", draft_.place_viscous[i],
                        kMovementBounds.friction.viscous);
    }
    FrictionMap::Config& map = control.friction_map.emplace(draft_.friction_map);
    for (std::size_t i = 0; i < count; ++i) {
      map.places.push_back(
          {draft_.places[i], {.coulomb = draft_.place_coulomb[i], .viscous = draft_.place_viscous[i]}});
    }
  }

  /// Refuses a friction bound of a real device above the friction of any known device.
  void refuse_impossible(const std::string& key, double bound, double most) const {
    if (bound <= most || !draft_.scene.driver().moves_a_hand) return;
    const Unit& unit = unit_of(key);
    blame(key, {},
          "expected at most " + with_symbol(digits(most), unit) +
              ", because no handle has more friction and a higher bound voids the limiter's proof, found " +
              digits(bound) + ": were all columns in the units that tendon-identify expects (s, m, N)?");
  }

  void resolve_preset(HapticController::Config& control) const {
    if (!draft_.preset) return;
    LimiterConfig& limiter = control.limiter;
    if (limiter.law != Law::kAolPlus) {
      blame("limiter.preset", {"limiter.preset", "limiter.kind"},
            "expected kind \"aol+\" with a preset, found " + in_quotes(info(limiter.law).name));
    }
    const std::optional<double> step = draft_.encoder_step();
    if (!step && draft_.scene.driver().moves_a_hand) {
      blame("limiter.robust_ledger.encoder_step_um", {"limiter.preset"},
            "missing, expected " + kZeroOrMore.expected(unit_of("_um")) +
                ", because the preset requires the encoder step of the device");
    }
    const PresetParts chosen = preset_parts(
        *draft_.preset,
        {.friction = limiter.friction, .longest_hold = limiter.longest_hold, .encoder_step = step.value_or(0)});
    if (limiter.parts.latency_reserve && chosen.parts.bounded_acceleration) {
      blame("limiter.latency_reserve", {"limiter.latency_reserve", "limiter.preset"},
            "expected no latency_reserve with a preset that includes bounded_acceleration, which is not proved for "
            "forces that are held late: use \"" +
                std::string(info(Preset::kFeelUnconditional).name) + "\"");
    }
    for_each_aol_part([&](const auto& part) {
      auto& listed = limiter.parts.*part.config;
      if (!listed) listed = chosen.parts.*part.config;
    });
    HeldForce::Config& hold = control.hold;
    if (!hold.adaptive_local_model && !hold.output_estimator && !hold.learned_model && !hold.field) {
      hold.learned_model = chosen.learned_model;
    }
  }

  void resolve_parts(LimiterConfig& limiter) const {
    if (limiter.parts.bounded_acceleration && !limiter.parts.shaping && !draft_.preset) {
      blame("limiter.shaping", {"limiter.bounded_acceleration"},
            "missing, expected this table with bounded_acceleration, because nothing else limits the stiffness");
    }
    if (limiter.parts.fading_contact && !limiter.parts.energy_cap && !draft_.preset) {
      blame("limiter.energy_cap", {"limiter.fading_contact"},
            "missing, expected this table with fading_contact, because only energy_cap has a credit for each contact");
    }
    if (limiter.parts.robust_ledger) {
      const std::optional<double> step = draft_.encoder_step();
      if (!step) {
        blame("limiter.robust_ledger.encoder_step_um", {},
              "missing, expected " + kZeroOrMore.expected(unit_of("_um")) +
                  ", because the device has no encoder_step_um");
      }
      limiter.parts.robust_ledger->encoder_step = {*step};
    }
  }

  /// `axis_share` is the fraction for a single axis.
  double friction_bound(const std::string& key, std::optional<double> given, const KnownNumber* profiles, double truth,
                        double axis_share) const {
    const std::string full = "limiter." + key;
    const Unit& unit = unit_of(key);
    if (!given && profiles == nullptr) {
      if (draft_.scene.loop.control.limiter.law == Law::kNone || !draft_.scene.driver().exerts_force) return 0;
      blame(full, {},
            "missing, expected " + kZeroOrMore.expected(unit) +
                (draft_.scene.driver().moves_a_hand ? ": use the value from tendon-identify for this device, or 0"
                                                    : ", because there is no profile"));
    }
    const double bound = given ? *given : profiles->value * axis_share;
    const double most = truth * axis_share;
    if (bound > most && !draft_.scene.driver().moves_a_hand && draft_.scene.driver().exerts_force) {
      blame(full, {full, "device.effects." + key},
            "expected at most " + with_symbol(digits(most), unit) + ", the true friction of the simulated device" +
                (axis_share < 1 ? " (each axis has 1/√3 of it)" : "") +
                ", because a higher bound voids the limiter's proof, found " + digits(bound) +
                (given ? "" : " (from the profile)"));
    }
    refuse_impossible(full, bound,
                      key.starts_with("coulomb") ? kMovementBounds.friction.coulomb : kMovementBounds.friction.viscous);
    return bound;
  }

  Draft& draft_;
};

}  // namespace

void resolve_limiter(Draft& draft, const SceneErrors& errors) { LimiterResolver(draft, errors).resolve(); }

}  // namespace tendon::scene_file
