// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace tendon::vectors {

/// Returns the generated files of protocol/vectors/ by name.
std::map<std::string, std::string> files();

}  // namespace tendon::vectors
