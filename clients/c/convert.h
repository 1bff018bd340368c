// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/c/tendon.h"
#include "clients/cpp/touch.h"
#include "protocol/messages.h"

// Converts between the structs of tendon.h and the messages of the protocol. The sizes are not used.

namespace tendon {

tendon_state to_c(const DeviceState& hand) noexcept;
/// `handle` is NULL if the server does not describe it. Texts are truncated.
tendon_description to_c(const DeviceDescription& device, const HandleDescription* handle) noexcept;
/// Members without their bit in `has` are ignored. Unknown bits must have been refused.
Touch to_touch(const tendon_force& force) noexcept;

}  // namespace tendon
