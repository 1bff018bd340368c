// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace tendon::vectors {

/// The files of protocol/vectors/ that our own code writes, by name: their text as it must be.
std::map<std::string, std::string> files();

}  // namespace tendon::vectors
