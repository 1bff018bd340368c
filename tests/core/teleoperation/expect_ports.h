// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "tests/core/teleoperation/ports.h"

namespace tendon {

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
