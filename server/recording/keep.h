// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// Which parts of a recording stay; see PartRecorder.
enum class Keep : std::uint8_t {
  kAll,
  kFaults,  ///< the parts around the beginning of a device's fault: from 60 s before it to 10 s after
};

}  // namespace tendon
