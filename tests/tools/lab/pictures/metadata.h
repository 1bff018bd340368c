// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

namespace tendon::lab {

/// Adds a text to a picture: an iTXt chunk after the header of a .png file (PNG 1.2, section 4.2.3), or the element
/// `desc` of an .svg file, which has one. `key`: the keyword of the chunk, for example "Description". Replaces the file in one
/// step. Throws std::runtime_error if the file is not such a picture or cannot be written.
void add_metadata(const std::filesystem::path& picture, std::string_view key, std::string_view text);

}  // namespace tendon::lab
