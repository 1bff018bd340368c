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

/// A secret that a client and a server share, and the role that it grants.
struct ClientKey {
  std::string name;               ///< of the client, for people; not a secret, and not in the file
  Role role = Role::kController;  ///< the most that the server grants: a controller may also observe
  Key key;
};

/// Tells a server which key to try, and reveals nothing else about the key.
using KeyId = std::array<std::byte, 8>;
KeyId key_id(const Key& key) noexcept;

// A key file is text. Empty lines and lines that begin with # are comments. Exactly one other line remains:
//
//     controller 64 hexadecimal digits
//
// or `observer` and the digits. Server and client have the same file.

std::string key_file_text(const ClientKey& key);

/// Reads the text of a key file whose permissions are `mode` (st_mode). Throws std::invalid_argument when anybody but
/// the owner may read or write the file, when the text is no key file, or when the key is weak. The message is a
/// sentence without the file's name, and never contains the key.
ClientKey read_key_file(std::string_view text, unsigned mode, std::string name);

/// Bytes of the largest key file: one line and a few comments.
inline constexpr std::size_t kMaxKeyFile = 4096;

/// Why this key is weak, in words; empty when it is not. A random key is called weak with a probability below 10⁻⁹.
std::optional<std::string> weakness(const Key& key);

}  // namespace tendon
