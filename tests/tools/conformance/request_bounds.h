// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "tests/tools/conformance/datagram.h"

// The bounds of the requests from WIRE.md, independent of protocol/wire.

namespace tendon::conformance {

/// A request without an id. Only `field` is out of bounds, for example "stiffness_npm" or "rate.gain_per_s".
struct BadRequest {
  std::string field;
  pb::Control control;
};

/// Returns each request with each of its fields out of bounds, including unknown values of enumerations.
std::vector<BadRequest> requests_out_of_bounds();

std::string field_out_of_bounds(const pb::Control& control);

}  // namespace tendon::conformance
