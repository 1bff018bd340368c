// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// See PartRecorder.
enum class Keep : std::uint8_t {
  kAll,
  kFaults,  ///< from 60 s before to 10 s after the start of a fault
};

}  // namespace tendon
