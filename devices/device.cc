// SPDX-License-Identifier: Apache-2.0
#include "devices/device.h"

namespace tendon {

// Here, so that no compiler weighs it where a device's step is inlined.
bool Device::armed() const noexcept { return true; }

void Device::set_output(LocalTime /*now*/, std::uint32_t /*output*/, const OutputSetting& /*setting*/) noexcept {}

}  // namespace tendon
