// SPDX-License-Identifier: Apache-2.0
#include "devices/device.h"

namespace tendon {

// Here, so that no compiler weighs it where a device's step is inlined.
bool Device::armed() const noexcept { return true; }

}  // namespace tendon
