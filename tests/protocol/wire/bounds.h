// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::bounds {

/// One field is at a bound of tendon.proto or just beyond it. All other fields are the same as in examples.h.
struct Case {
  std::string message;          ///< of the body: "Datagram", "Hello" or "Answer"
  std::string field;            ///< "DeviceState.position_m.x"
  std::string value;            ///< description
  bool accepted = false;        ///< by every receiver
  std::vector<std::byte> body;  ///< protobuf
};

/// Returns the cases for all bounds in the comments of `proto` (the text of tendon.proto) and for all enum values.
/// Throws std::invalid_argument if a comment that begins with a bracket breaks the grammar, if no example has a field
/// with a bound, or if a double, time, text or list has no bound.
std::vector<Case> cases(std::string_view proto);

}  // namespace tendon::bounds
