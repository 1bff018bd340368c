// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string_view>

namespace tendon {

/// Throws std::runtime_error with the name of the file if the folder does not exist, or if the file is not one of this
/// tool: not a regular file, or neither empty nor beginning with one of the `beginnings`. Always allows /dev/null and
/// /dev/stdout.
void expect_replaceable(const std::filesystem::path& file, std::initializer_list<std::string_view> beginnings);

}  // namespace tendon
