// SPDX-License-Identifier: Apache-2.0
#include "devices/device.h"

namespace tendon {

// Not inline, so that the compiler does not count it when it inlines the step of a device.
bool Device::armed() const noexcept { return true; }

void Device::set_output(LocalTime /*now*/, std::uint32_t /*output*/, const OutputSetting& /*setting*/) noexcept {}

}  // namespace tendon
