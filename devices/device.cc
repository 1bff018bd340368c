// SPDX-License-Identifier: Apache-2.0
#include "devices/device.h"

namespace tendon {

// Not inlined, because this would affect the inlining of a device's step.
bool Device::armed() const noexcept { return true; }

void Device::set_output(LocalTime /*now*/, std::uint32_t /*output*/, const OutputSetting& /*setting*/) noexcept {}

}  // namespace tendon
