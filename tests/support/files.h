// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string_view>

namespace tendon {

/// What a tool asks before it writes `file`. Throws std::runtime_error, naming the file, when something is there that
/// is not what the tool writes: no regular file, or one that is not empty and begins with none of `beginnings`.
/// /dev/null and /dev/stdout are let through.
void expect_replaceable(const std::filesystem::path& file, std::initializer_list<std::string_view> beginnings);

}  // namespace tendon
