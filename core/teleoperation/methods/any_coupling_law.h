// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>
#include <variant>

#include "core/teleoperation/methods/passivity_law.h"
#include "core/teleoperation/methods/rate_law.h"
#include "core/teleoperation/methods/spring_laws.h"
#include "core/teleoperation/methods/surface_law.h"
#include "core/teleoperation/methods/wave_law.h"

namespace tendon {

/// A law with the functions of CouplingLaw. The variant does not allocate memory. Alternative i belongs to
/// kCouplingMethods[i].
using AnyCouplingLaw = std::variant<SpringLaw, ContactLaw, WaveLaw, SurfaceLaw, PassivityLaw, SetPositionLaw, RateLaw>;
static_assert(std::variant_size_v<AnyCouplingLaw> == kCouplingMethods.size());

/// Throws std::invalid_argument if the configuration is not valid.
template <std::size_t index = 0>
AnyCouplingLaw coupling_law_of(const CouplingConfig& config, const MappedEnd& frame) {
  if constexpr (index + 1 < kCouplingMethods.size()) {
    if (config.method != kCouplingMethods[index]) return coupling_law_of<index + 1>(config, frame);
  }
  return AnyCouplingLaw(std::in_place_index<index>, config, frame);
}

}  // namespace tendon
