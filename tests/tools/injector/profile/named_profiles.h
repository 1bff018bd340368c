// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

/// A network that many know, as two profiles. The source of each number is beside it in named_profiles.cc.
struct NamedProfile {
  std::string_view name;
  std::string_view what;  ///< one line
  std::string_view up;    ///< client to server, as profile line
  std::string_view down;  ///< server to client
};

std::span<const NamedProfile> named_profiles();

/// "lan, wifi-good, …"
std::string names_of_profiles();

/// What users write for a profile: a line, a name, or a name and after it a line of what is to be different:
/// "wifi-bad loss=5%". Throws std::invalid_argument like parse_profile().
Profile resolve_profile(std::string_view text, Direction direction);

}  // namespace tendon::injector
