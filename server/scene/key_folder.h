// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "protocol/secrets/client_key.h"

namespace tendon {

/// The keys of a folder, one for each file NAME.key, in the order of the names. Other files are ignored. Throws
/// std::runtime_error, "FILE: what is wrong", when the folder cannot be read or has no key, and when one of its keys is
/// readable by others, no regular file, no key file, or weak.
std::vector<ClientKey> read_key_folder(const std::filesystem::path& folder);

/// The key of one file, with the name of the file as its own; throws likewise.
ClientKey read_key(const std::filesystem::path& file);

/// Writes a new key file that only its owner may read. Throws std::runtime_error when it cannot, or when there is such
/// a file already; nothing is left behind then: the key is written under another name first.
void write_key_file(const std::filesystem::path& file, const ClientKey& key);

}  // namespace tendon
