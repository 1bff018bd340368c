// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/core/teleoperation/ports.h"

namespace tendon {

/// Checks accounts and pair.
template <class AnyPorts, class When = const char*>
requires requires(const AnyPorts& ports) { ports.least_sum; }
void expect_passive(const AnyPorts& ports, const When& when = "") {
  EXPECT_GE(ports.least_account(), kRounding) << when;
  EXPECT_GE(ports.least_sum, kRounding) << when;
}

inline void expect_coupled(const Ports& ports, const std::string& when) {
  EXPECT_EQ(phase(ports.leader), PortPhase::kCoupled) << when;
  EXPECT_EQ(phase(ports.follower), PortPhase::kCoupled) << when;
}

inline void expect_no_engagement(Ports& ports, int ticks, const std::string& when) {
  bool engaged = false;
  ports.run(ticks, [&](int) {
    for (const Port* port : {&ports.leader, &ports.follower}) {
      engaged = engaged || phase(*port) == PortPhase::kEngaged || phase(*port) == PortPhase::kClutched;
    }
  });
  EXPECT_FALSE(engaged) << when;
}

}  // namespace tendon
