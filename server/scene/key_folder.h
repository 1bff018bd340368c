// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "protocol/secrets/client_key.h"

namespace tendon {

/// Reads the keys in all files NAME.key of a directory, sorted by name. Throws std::runtime_error "FILE: what is wrong"
/// if there are no keys, or if a key is weak, is readable by other users, or is not in a valid regular file.
std::vector<ClientKey> read_key_folder(const std::filesystem::path& folder);

/// The name of the key is the name of the file. Throws the same errors.
ClientKey read_key(const std::filesystem::path& file);

/// Creates a complete file that only its owner can read. Throws std::runtime_error on failure or if it already exists.
void write_key_file(const std::filesystem::path& file, const ClientKey& key);

}  // namespace tendon
