// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/wire/header.h"

namespace tendon {

/// A suite that seals, by the name that scenes and people call it. The name of suite 2 is also the feature by which a
/// client offers it and a server chooses it.
struct NamedSuite {
  Suite suite;
  std::string_view name;
};

/// All of them, in the order in which a server chooses: the fastest first. The only list.
inline constexpr std::array kSealedSuites = {NamedSuite{Suite::kAesGcm, "aes-256-gcm"},
                                             NamedSuite{Suite::kNoise, "chacha20-poly1305"}};
inline constexpr std::string_view kFeatureAesGcm = kSealedSuites[0].name;
static_assert(kSealedSuites[0].suite == Suite::kAesGcm);

/// Some of them, each once.
using Suites = std::vector<Suite>;

Suites all_suites();
bool contains(const Suites& suites, Suite suite) noexcept;

/// Those of kSealedSuites that this processor can speak: suite 2 takes AES in hardware (crypto::has_aes). Throws
/// std::runtime_error when libsodium cannot start.
Suites suites_of_this_machine();

/// The names, for a sentence: "aes-256-gcm, chacha20-poly1305".
std::string names_of(const Suites& suites);

/// Refuses a list that one end cannot work with: throws std::invalid_argument when it is empty, holds anything else
/// than the suites above, or one that this processor cannot speak.
void expect_speakable(const Suites& suites);

}  // namespace tendon
