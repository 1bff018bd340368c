// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

namespace tendon::vectors {

std::map<std::string, std::string> files();

}  // namespace tendon::vectors
