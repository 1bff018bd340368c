// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace tendon {

/// Stored in recordings and tables. Defined in a separate file, so that a new commit only recompiles this file.
extern const std::string_view kVersion;  ///< project() version in CMakeLists.txt, e.g. 0.1.0
extern const std::string_view kCommit;   ///< 12 hex digits, or "unknown" if built without git

inline std::string version_text() { return std::string(kVersion) + " (" + std::string(kCommit) + ")"; }

}  // namespace tendon
