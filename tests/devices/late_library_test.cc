// SPDX-License-Identifier: Apache-2.0
#include "devices/late_library.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "tests/support/refusal.h"

namespace tendon::late_library_test {
namespace {

TEST(LateLibrary, GivesItsFunctionsByName) {
  const LateLibrary mathematics("libm.so.6");
  const decltype(&::acosh) found = mathematics["acosh"];
  EXPECT_EQ(found(1.0), 0.0);
}

TEST(LateLibrary, ThatIsMissingIsNamedWithWhatIsExpected) {
  const std::string text = thrown_by<std::runtime_error>([] { LateLibrary("libtendon-none.so.7"); });
  EXPECT_NE(text.find("libtendon-none.so.7"), std::string::npos) << text;
  EXPECT_NE(text.find("; is the package installed?"), std::string::npos) << text;
}

TEST(LateLibrary, WithoutAFunctionSaysWhich) {
  const LateLibrary mathematics("libm.so.6");
  const std::string text = thrown_by<std::runtime_error>([&] { static_cast<void>(mathematics["tendon_none"]); });
  EXPECT_NE(text.find("tendon_none"), std::string::npos) << text;
}

}  // namespace
}  // namespace tendon::late_library_test
