// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace tendon::softbody {

/// All of a file: a scene, a mesh. Throws std::invalid_argument with a sentence when it cannot be read, when it is not
/// a regular file (a pipe would wait for ever, a device might never end), or when it has more than `most` bytes.
std::string read_file(const std::filesystem::path& file, std::uintmax_t most);

}  // namespace tendon::softbody
