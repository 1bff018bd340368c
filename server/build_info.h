// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace tendon {

/// Version and commit of this build, stored in recordings and tables. They are defined in a separate file so that a new
/// commit recompiles only that file.
extern const std::string_view kVersion;  ///< project() version in CMakeLists.txt, e.g. 0.1.0
extern const std::string_view kCommit;   ///< 12 hex digits, or "unknown" if built without git

inline std::string version_text() { return std::string(kVersion) + " (" + std::string(kCommit) + ")"; }

}  // namespace tendon
