// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace tendon::softbody {

/// All of a file: a scene, a mesh. Throws std::invalid_argument with a sentence when it cannot be read, when it is not
/// a regular file (a pipe would wait for ever, a device might never end), or when it has more than `most` bytes.
std::string read_file(const std::filesystem::path& file, std::uintmax_t most);

/// Throws std::invalid_argument "`name`: `what`".
[[noreturn]] void refuse_file(std::string_view name, const std::string& what);

/// Removes the byte order mark of UTF-8. Throws std::invalid_argument if the text begins with the mark of UTF-16.
std::string_view without_mark(std::string_view text, std::string_view name);

}  // namespace tendon::softbody
