// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/messages.h"
#include "protocol/secrets/crypto.h"

namespace tendon {

struct ClientKey {
  std::string name;               ///< for people; not secret, not in the file
  Role role = Role::kController;  ///< highest role granted
  Key key;
};

/// Identifies a key, but does not reveal anything else about it.
using KeyId = std::array<std::byte, 8>;
KeyId key_id(const Key& key) noexcept;

/// The text of a key file (WIRE.md, "Key file").
std::string key_file_text(const ClientKey& key);

/// Parses a key file with the permissions `mode` (st_mode). Throws std::invalid_argument if other users have access to
/// the file, if the text is not a key file, or if the key is weak. The message contains neither file name nor key.
ClientKey read_key_file(std::string_view text, unsigned mode, std::string name);

inline constexpr std::size_t kMaxKeyFile = 4096;  ///< bytes

/// Returns the reason if a key is weak. A random key is considered weak with a probability below 10⁻⁹.
std::optional<std::string> weakness(const Key& key);

}  // namespace tendon
