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
/// Ignores the members whose bits in `has` are not set. Call check_bits() first.
Touch to_touch(const tendon_force& force) noexcept;

}  // namespace tendon
