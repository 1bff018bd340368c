// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

/// A predefined network of two profiles. named_profiles.cc gives the origin of each number.
struct NamedProfile {
  std::string_view name;
  std::string_view what;
  std::string_view source;  ///< citation, and the assumed parts
  std::string_view up;      ///< client to server, as a profile line
  std::string_view down;    ///< server to client
};

std::span<const NamedProfile> named_profiles();

/// For example "lan, wifi-good, …".
std::string names_of_profiles();

/// Parses a line, a name, or a name and a line of changes ("wifi-bad loss=5%"). Throws std::invalid_argument if the
/// profile is not valid.
Profile resolve_profile(std::string_view text, Direction direction);

}  // namespace tendon::injector
