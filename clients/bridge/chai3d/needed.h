// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace tendon::bridge::chai3d {

/// Returns the shared libraries that a program depends on (DT_NEEDED; System V ABI, chapter 5). `file` is a 64-bit ELF
/// file in native byte order; other files, including scripts, and malformed files give an empty list.
std::vector<std::string> needed_libraries(std::span<const std::byte> file);

}  // namespace tendon::bridge::chai3d
