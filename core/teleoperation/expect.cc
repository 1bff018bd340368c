// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/expect.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace tendon {

namespace {

void expect(bool holds, double value, const char* field, const char* expected) {
  if (holds && std::isfinite(value)) return;
  throw std::invalid_argument(std::string(field) + " = " + std::to_string(value) + ": expected a finite number " +
                              expected);
}

}  // namespace

void expect_above_zero(double value, const char* field) { expect(value > 0, value, field, "above 0"); }
void expect_not_negative(double value, const char* field) { expect(value >= 0, value, field, "of 0 or more"); }

}  // namespace tendon
