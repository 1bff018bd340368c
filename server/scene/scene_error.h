// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <stdexcept>

namespace tendon {

/// "FILE:LINE: KEY: expected …, found …". Without LINE if it is unknown, and without KEY for syntax errors.
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Bytes. Protects against files of other types. At 4 times this size, nested tables overflow a stack of 8 MiB.
inline constexpr std::size_t kMaxSceneBytes = 16'384;

}  // namespace tendon
