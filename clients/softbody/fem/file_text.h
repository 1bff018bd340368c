// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace tendon::softbody {

/// Returns the contents of a file. Throws std::invalid_argument if the file cannot be read, is not a regular file
/// (reading a pipe or device might never end), or is larger than `most` bytes.
std::string read_file(const std::filesystem::path& file, std::uintmax_t most);

[[noreturn]] void refuse_file(std::string_view name, const std::string& what);

/// Removes a UTF-8 byte order mark. Throws std::invalid_argument if the text starts with a UTF-16 mark.
std::string_view without_mark(std::string_view text, std::string_view name);

}  // namespace tendon::softbody
