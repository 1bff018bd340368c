// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace tendon::plug::chai3d {

/// The shared libraries that a program names (DT_NEEDED, System V ABI, chapter 5), from the bytes of its file: an ELF
/// file of 64 bits of this machine's byte order. Empty for everything else, for a script too, and for a file that
/// contradicts itself.
std::vector<std::string> needed_libraries(std::span<const std::byte> file);

}  // namespace tendon::plug::chai3d
