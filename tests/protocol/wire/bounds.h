// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::bounds {

/// One field of one message at a bound of tendon.proto, or right beyond it; all else is as in an example (examples.h).
struct Case {
  std::string message;          ///< that is the body: "Datagram", "Hello" or "Answer"
  std::string field;            ///< "DeviceState.position_m.x"
  std::string value;            ///< in words
  bool accepted = false;        ///< by every receiver
  std::vector<std::byte> body;  ///< protobuf
};

/// Every bound in the comments of `proto`, the text of tendon.proto, and the values of every enum. Throws
/// std::invalid_argument when a comment that begins with a bracket breaks the grammar, when no example holds a field
/// that has a bound, and when a double, a time, a text or a list has none.
std::vector<Case> cases(std::string_view proto);

}  // namespace tendon::bounds
