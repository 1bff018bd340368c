// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace tendon {

/// What this program was built from; recordings and tables carry it. A new commit compiles one file anew, and links.
extern const std::string_view kVersion;  ///< of CMakeLists.txt's project(): 0.1.0
extern const std::string_view kCommit;   ///< twelve digits, or "unknown" where there was no git

/// The answer to --version: "0.1.0 (f0e3f7af2b1c)".
inline std::string version_text() { return std::string(kVersion) + " (" + std::string(kCommit) + ")"; }

}  // namespace tendon
