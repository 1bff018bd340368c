// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string_view>
#include <tuple>

#include "core/control/aol_plus.h"

namespace tendon {

/// AOL+ for a point in space, the law of a scene with parts.
using PointAolPlus = AolPlus<1, 3>;

template <class Config>
struct AolPart {
  std::string_view name;                               ///< the name of its table under [limiter] in a scene
  std::string_view what;                               ///< its purpose in one line
  std::optional<Config> PointAolPlus::Parts::*config;  ///< member with its configuration
};

/// Used by scenes, `tendond explain` and the lab. A test compares this list with the table in core/control/README.md.
inline constexpr std::tuple kAolParts{
    AolPart<PointAolPlus::EnergyCap>{"energy_cap", "limits the credit", &PointAolPlus::Parts::energy_cap},
    AolPart<PointAolPlus::Robust>{"robust_ledger", "earns no credit from the rounding of positions",
                                  &PointAolPlus::Parts::robust_ledger},
    AolPart<PointAolPlus::Knee>{"knee", "starts to limit gradually", &PointAolPlus::Parts::knee},
    AolPart<PointAolPlus::LatencyReserve>{"latency_reserve", "reserves credit for forces that are not applied yet",
                                          &PointAolPlus::Parts::latency_reserve},
    AolPart<PointAolPlus::BoundedAcceleration>{"bounded_acceleration",
                                               "bounds the acceleration, for devices with little damping",
                                               &PointAolPlus::Parts::bounded_acceleration},
    AolPart<PointAolPlus::Shaping>{"shaping", "limits the rendered stiffness", &PointAolPlus::Parts::shaping},
    AolPart<PointAolPlus::AdaptiveFriction>{"adaptive_friction", "uses friction bounds that depend on the position",
                                            &PointAolPlus::Parts::adaptive_friction},
    AolPart<PointAolPlus::Thrift>{"thrift", "saves credit for the next contact", &PointAolPlus::Parts::thrift},
    AolPart<PointAolPlus::Damper>{"damper", "damps vibrations of the hand", &PointAolPlus::Parts::damper},
    AolPart<PointAolPlus::FadingContact>{"fading_contact", "lets the credit of a contact decay slowly",
                                         &PointAolPlus::Parts::fading_contact},
};

/// Calls `visit` for each part. `parts.*part.config` is its optional configuration.
template <class Visit>
constexpr void for_each_aol_part(Visit&& visit) {
  std::apply([&](const auto&... part) { (visit(part), ...); }, kAolParts);
}

}  // namespace tendon
