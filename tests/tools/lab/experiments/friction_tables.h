// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <ostream>
#include <vector>

#include "core/identification/friction_identification.h"
#include "tests/support/json_line.h"

namespace tendon::lab {

/// The friction identification of Lee & Lee 2009 (Tables II, III; the numbers are lost) on a device with known
/// friction: results of Kelly's procedure and of the integral, and which of them is trusted.
struct FrictionTable {
  Friction truth;
  Identification found;
  std::uint64_t seed = 0;
};

/// Ramps of 0.05, 0.1 and 0.5 N/s, 5 times in each direction over 0.25 m, 75 g, 30 µm resolution, 5 mN of force noise;
/// f_c = 0.05 N and b from kTableDampings.
FrictionTable friction_table(double damping);
inline constexpr std::array kTableDampings = {0.26, 0.05, 0.005};  ///< N·s/m

void write(std::ostream& out, const std::vector<FrictionTable>& tables);
/// Returns one line of JSON. The `commit` is the one of the build.
JsonLine json_of(const FrictionTable& table);
/// Parses a line that was written by json_of(). Throws an exception if it is not valid.
FrictionTable friction_table_of(const nlohmann::json& line);

}  // namespace tendon::lab
