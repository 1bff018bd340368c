// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "protocol/secrets/client_key.h"

namespace tendon {

/// Reads all keys of a directory. Each key is in a file NAME.key, and other files are ignored. The keys are sorted by
/// name. Throws std::runtime_error "FILE: what is wrong" if the directory cannot be read or does not contain any keys,
/// or if a key is weak, is readable by other users, or is not in a valid regular file.
std::vector<ClientKey> read_key_folder(const std::filesystem::path& folder);

/// Reads a single key. The name of the key is the name of the file. Throws the same errors.
ClientKey read_key(const std::filesystem::path& file);

/// Writes a new key file that can only be read by its owner. Throws std::runtime_error if this is not possible or if
/// the file already exists. The key is written to a temporary file first, so no incomplete file is left behind.
void write_key_file(const std::filesystem::path& file, const ClientKey& key);

}  // namespace tendon
