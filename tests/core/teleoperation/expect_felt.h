// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <iomanip>
#include <iostream>
#include <string>

#include "tests/core/teleoperation/ports.h"
#include "tests/core/teleoperation/pressing.h"

namespace tendon {

inline void print(const std::string& name, const Felt& felt) {
  std::cout << name << std::fixed << std::setprecision(3) << ": felt " << felt.first << ", " << felt.second
            << " N, wall " << felt.wall << " N, ripple " << felt.ripple * 1e3 << " mN, buzz " << felt.buzz * 1e3
            << " mm/s, least sum " << felt.sum * 1e3 << " mJ, account " << felt.account * 1e3 << " mJ, K "
            << felt.stiffness << "\n";
}

inline void expect_passive(const Felt& felt, const std::string& name) {
  EXPECT_GE(felt.sum, kRounding) << name;
  EXPECT_GE(felt.account, kRounding) << name;
  EXPECT_TRUE(felt.live) << name;
}

}  // namespace tendon
