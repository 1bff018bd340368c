// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <stdexcept>

namespace tendon {

/// The message is "FILE:LINE: KEY: expected …, found …". The line is omitted if it is unknown, for example because a
/// table is missing. The key is omitted for syntax errors.
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bytes. Protects against files of other types. With deeply nested tables, a file of 4 times this size causes a stack
/// overflow in toml++ if the stack has 8 MiB.
inline constexpr std::size_t kMaxSceneBytes = 16'384;

}  // namespace tendon
