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

/// A key shared by a client and a server, and the role that it grants.
struct ClientKey {
  std::string name;               ///< name of the client for people; it is not secret and not in the file
  Role role = Role::kController;  ///< highest role that the server grants; a controller may also observe
  Key key;
};

/// Identifies a key to the server without revealing anything else about it.
using KeyId = std::array<std::byte, 8>;
KeyId key_id(const Key& key) noexcept;

// A key file is a text file. Empty lines and lines that begin with # are ignored. It must contain exactly one other
// line:
//
//     controller 64 hexadecimal digits
//
// or `observer` and the digits. Server and client use the same file.

std::string key_file_text(const ClientKey& key);

/// Parses a key file whose permissions are `mode` (st_mode). Throws std::invalid_argument if the file is accessible to
/// anyone but the owner, if the text is not a key file, or if the key is weak. The message does not contain the file
/// name or the key.
ClientKey read_key_file(std::string_view text, unsigned mode, std::string name);

/// Maximum size of a key file in bytes.
inline constexpr std::size_t kMaxKeyFile = 4096;

/// Explains why a key is weak, or returns nullopt. A random key is considered weak with a probability below 10⁻⁹.
std::optional<std::string> weakness(const Key& key);

}  // namespace tendon
