// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "core/base/time.h"
#include "protocol/secrets/suites.h"
#include "tests/tools/bench/peers/echo_client.h"

namespace tendon::bench {

/// The request is a state of the server, and the reply is the force that answers it. The client runs in another process.
/// Both block. A state is sent again if the force does not arrive within 200 ms. Throws std::runtime_error if it does not
/// arrive within ten seconds. There must be only one thread, because this forks.
std::unique_ptr<EchoClient> tendon_echo_client(std::optional<Suite> suite, Duration reply_delay, int priority);

}  // namespace tendon::bench
