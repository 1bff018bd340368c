// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/wire/header.h"

namespace tendon {

/// A sealed suite. The name is used in scene files, and for suite 2 also as the feature that is offered and chosen.
struct NamedSuite {
  Suite suite;
  std::string_view name;
};

/// In the order of the server's preference.
inline constexpr std::array kSealedSuites = {NamedSuite{Suite::kAesGcm, "aes-256-gcm"},
                                             NamedSuite{Suite::kNoise, "chacha20-poly1305"}};
inline constexpr std::string_view kFeatureAesGcm = kSealedSuites[0].name;
static_assert(kSealedSuites[0].suite == Suite::kAesGcm);

using Suites = std::vector<Suite>;

Suites all_suites();
bool contains(const Suites& suites, Suite suite) noexcept;

/// The suites of this processor; suite 2 requires crypto::has_aes(). Throws std::runtime_error if libsodium fails.
Suites suites_of_this_machine();

std::string names_of(const Suites& suites);  ///< for messages: "aes-256-gcm, chacha20-poly1305"

/// Throws std::invalid_argument if the list is empty, or if a suite is not sealed or not supported by this processor.
void expect_speakable(const Suites& suites);

}  // namespace tendon
