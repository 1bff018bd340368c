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

/// What a client and a server share: a secret, and what may be done with it.
struct ClientKey {
  std::string name;               ///< of the client, for people; not a secret, and not in the file
  Role role = Role::kController;  ///< the most that the server grants: a controller may also observe
  Key key;
};

/// Tells a server which key to try; it says nothing else.
using KeyId = std::array<std::byte, 8>;
KeyId key_id(const Key& key) noexcept;

// A key file is text: empty lines and lines that begin with # are comments; one line is left,
//
//     controller 64 hexadecimal digits
//
// or `observer` and the digits. Server and client have the same file.

std::string key_file_text(const ClientKey& key);

/// Reads the text of a key file whose permissions are `mode` (st_mode). Throws std::invalid_argument with a
/// sentence (without the file's name, and never with the key) when others than its owner may read or write
/// it, the text is no key file, or the key is weak.
ClientKey read_key_file(std::string_view text, unsigned mode, std::string name);

/// The largest key file: a line and a few comments.
inline constexpr std::size_t kMaxKeyFile = 4096;

/// Why nobody should use this key, in words; empty when nothing speaks against it. A random key is
/// called weak with a probability below 10⁻⁹.
std::optional<std::string> weakness(const Key& key);

}  // namespace tendon
