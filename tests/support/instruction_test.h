// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>

namespace tendon::testing {

/// Skips tests that use callgrind.h if valgrind is missing.
class InstructionTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v valgrind > /dev/null") != 0) GTEST_SKIP() << "skipped: there is no valgrind";
  }
};

}  // namespace tendon::testing
