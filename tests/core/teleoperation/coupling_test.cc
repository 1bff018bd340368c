// SPDX-License-Identifier: Apache-2.0
//
// Two couplings between two devices: phases, engagement by an act alone, the ladder. coupling_force_test.cc has what is
// felt, coupling_world_test.cc the search.
#include "core/teleoperation/coupling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/core/control/adversary.h"
#include "tests/core/teleoperation/ports.h"

namespace tendon {
namespace {

using std::chrono::milliseconds;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

PortSetup setup_of(PortRole role) {
  PortSetup setup;
  setup.coupling = coupling_of(role);
  return setup;
}

TEST(Coupling, IsAloneThenCoupledAndEngagedOnlyByTheAct) {
  Ports ports(setup_of(PortRole::kLeader), setup_of(PortRole::kFollower), {.delay = 10, .seed = 1},
              {.delay = 10, .seed = 2});
  EXPECT_FALSE(ports.leader.coupling->engage());
  ports.run(1);
  EXPECT_EQ(ports.leader.coupling->phase(), PortPhase::kAlone);
  ports.run(1000);
  EXPECT_EQ(ports.leader.coupling->phase(), PortPhase::kCoupled);
  EXPECT_EQ(ports.follower.coupling->phase(), PortPhase::kCoupled);
  EXPECT_FALSE(ports.follower.coupling->engage()) << "the leader's business";
  EXPECT_TRUE(ports.leader.coupling->engage());
  EXPECT_EQ(ports.leader.coupling->phase(), PortPhase::kEngaged);
  ports.run(11);
  EXPECT_TRUE(ports.follower.coupling->live()) << "one way later";
  EXPECT_FALSE(ports.leader.coupling->live());
  ports.run(10);
  EXPECT_TRUE(ports.leader.coupling->live()) << "a round trip later";
  EXPECT_TRUE(ports.leader.coupling->engage()) << "it was already";
  EXPECT_EQ(ports.told_there.engagement, 1U);
}

}  // namespace
}  // namespace tendon
