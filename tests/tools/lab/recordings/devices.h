// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace tendon::lab {

/// The first device has the name from its scene, or "first". Control characters are escaped (protocol/wire/text.h).
/// Throws std::runtime_error if the recording cannot be read.
std::vector<std::string> device_names(const std::filesystem::path& recording);

}  // namespace tendon::lab
