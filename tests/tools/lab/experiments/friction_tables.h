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

/// The paper's friction identification (Tables II, III; the numbers are lost) on a device whose friction is known: what
/// Kelly's procedure finds there, what the integral does, and which of the two can be believed.
struct FrictionTable {
  Friction truth;
  Identification found;
  std::uint64_t seed = 0;
};

/// Ramps of 0.05, 0.1 and 0.5 N/s, 5 times each way over 0.25 m, 75 g, counts of 30 µm, 5 mN of noise in the force; for
/// b = 0.26, 0.05 and 0.005 N·s/m and f_c = 0.05 N: one for each of kTableDampings.
FrictionTable friction_table(double damping);
inline constexpr std::array kTableDampings = {0.26, 0.05, 0.005};  ///< N·s/m

/// Rows of `tendon-lab paper`.
void write(std::ostream& out, const std::vector<FrictionTable>& tables);
/// One line of JSON; `commit` is that of the build.
JsonLine json_of(const FrictionTable& table);
/// Of such a line, as much as is in it. Throws when it is none.
FrictionTable friction_table_of(const nlohmann::json& line);

}  // namespace tendon::lab
