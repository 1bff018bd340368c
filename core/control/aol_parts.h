// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <tuple>

#include "core/control/aol_plus.h"

namespace tendon {

/// The law of a scene that has parts: AOL+ for a point in space.
using PointAolPlus = AolPlus<1, 3>;

/// One part of AOL+: its name, what it is for, and where its configuration is.
template <class Config>
struct AolPart {
  std::string_view name;  ///< of its table in a scene, below [limiter]
  std::string_view what;  ///< what it is for, one line
  std::optional<Config> PointAolPlus::Parts::*config;
};

/// Every part of AOL+, in the order in which tables list them. Scenes, `tendond explain` and the lab read this list,
/// and tests hold the table in core/control/README.md against it.
inline constexpr std::tuple kAolParts{
    AolPart<PointAolPlus::EnergyCap>{"energy_cap", "credit is capped", &PointAolPlus::Parts::energy_cap},
    AolPart<PointAolPlus::Robust>{"robust_ledger", "rounding of positions earns nothing",
                                  &PointAolPlus::Parts::robust_ledger},
    AolPart<PointAolPlus::Knee>{"knee", "no hard edge where the limiter begins", &PointAolPlus::Parts::knee},
    AolPart<PointAolPlus::LatencyReserve>{"latency_reserve", "forces under way are paid for",
                                          &PointAolPlus::Parts::latency_reserve},
    AolPart<PointAolPlus::BoundedAcceleration>{"bounded_acceleration", "for devices with next to no damping",
                                               &PointAolPlus::Parts::bounded_acceleration},
    AolPart<PointAolPlus::Shaping>{"shaping", "no object is shown stiffer than this", &PointAolPlus::Parts::shaping},
    AolPart<PointAolPlus::AdaptiveFriction>{"adaptive_friction", "friction bounds by place",
                                            &PointAolPlus::Parts::adaptive_friction},
    AolPart<PointAolPlus::Thrift>{"thrift", "the next contact finds some credit", &PointAolPlus::Parts::thrift},
    AolPart<PointAolPlus::Damper>{"damper", "a hand that rings is damped", &PointAolPlus::Parts::damper},
    AolPart<PointAolPlus::FadingContact>{"fading_contact", "a contact's credit fades instead of vanishing",
                                         &PointAolPlus::Parts::fading_contact},
};

/// Calls `visit` with each part, in that order: `parts.*part.config` is the optional configuration of one.
template <class Visit>
constexpr void for_each_aol_part(Visit&& visit) {
  std::apply([&](const auto&... part) { (visit(part), ...); }, kAolParts);
}

}  // namespace tendon
