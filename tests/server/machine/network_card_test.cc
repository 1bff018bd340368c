// SPDX-License-Identifier: Apache-2.0
#include "server/machine/network_card.h"

#include <gtest/gtest.h>

#include <string>

namespace tendon::network_card_test {
namespace {

bool knows_nothing(const NetworkCard& card) { return !card.coalescing && !card.energy_efficient && !card.power_save; }

TEST(NetworkCard, TheLoopbackHasNoneOfTheSettings) { EXPECT_TRUE(knows_nothing(ask_network_card("lo"))); }

TEST(NetworkCard, OfANameThatIsNoInterfaceItKnowsNothing) {
  for (const std::string& name : {std::string(), std::string("no-such-card"), std::string(15, 'x'),
                                  std::string(16, 'x'), std::string(100'000, 'x'), std::string("../lo")}) {
    EXPECT_TRUE(knows_nothing(ask_network_card(name))) << name.substr(0, 20);
  }
}

}  // namespace
}  // namespace tendon::network_card_test
