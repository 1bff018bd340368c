// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "tests/tools/bench/peers/echo_client.h"

namespace tendon::bench {

/// Plain UDP, which is used as the baseline.
void serve_udp(EchoSetup& setup);
std::unique_ptr<EchoClient> udp_client(EchoSetup& setup);

}  // namespace tendon::bench
