// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <variant>

#include "core/teleoperation/methods/passivity_law.h"
#include "core/teleoperation/methods/rate_law.h"
#include "core/teleoperation/methods/spring_laws.h"
#include "core/teleoperation/methods/surface_law.h"
#include "core/teleoperation/methods/wave_law.h"

namespace tendon {

/// A law with the functions of CouplingLaw. The variant does not allocate memory.
using AnyCouplingLaw = std::variant<SpringLaw, ContactLaw, WaveLaw, SurfaceLaw, PassivityLaw, SetPositionLaw, RateLaw>;

/// Throws std::invalid_argument if the configuration is not valid.
inline AnyCouplingLaw coupling_law_of(const CouplingConfig& config, const MappedEnd& frame) {
  switch (config.method) {
    case CouplingMethod::kPositionForce:
      return AnyCouplingLaw(std::in_place_type<ContactLaw>, config, frame);
    case CouplingMethod::kWaves:
      return AnyCouplingLaw(std::in_place_type<WaveLaw>, config, frame);
    case CouplingMethod::kSurface:
      return AnyCouplingLaw(std::in_place_type<SurfaceLaw>, config, frame);
    case CouplingMethod::kPassivity:
      return AnyCouplingLaw(std::in_place_type<PassivityLaw>, config, frame);
    case CouplingMethod::kSetPosition:
      return AnyCouplingLaw(std::in_place_type<SetPositionLaw>, config, frame);
    case CouplingMethod::kRate:
      return AnyCouplingLaw(std::in_place_type<RateLaw>, config, frame);
    case CouplingMethod::kPositionPosition:
      break;
  }
  return AnyCouplingLaw(std::in_place_type<SpringLaw>, config, frame);
}

}  // namespace tendon
