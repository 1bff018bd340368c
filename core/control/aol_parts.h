// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <tuple>

#include "core/control/aol_plus.h"

namespace tendon {

/// AOL+ for a point in space, the law of a scene with parts.
using PointAolPlus = AolPlus<1, 3>;

/// One part of AOL+: its name, its purpose, and the member with its configuration.
template <class Config>
struct AolPart {
  std::string_view name;  ///< of its table in a scene, under [limiter]
  std::string_view what;  ///< its purpose in one line
  std::optional<Config> PointAolPlus::Parts::*config;
};

/// All parts of AOL+ in the order of the tables. Scenes, `tendond explain` and the lab use this list, and a test
/// compares it with the table in core/control/README.md.
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

/// Calls `visit` for each part. `parts.*part.config` is its optional configuration.
template <class Visit>
constexpr void for_each_aol_part(Visit&& visit) {
  std::apply([&](const auto&... part) { (visit(part), ...); }, kAolParts);
}

}  // namespace tendon
