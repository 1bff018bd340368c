// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace tendon::golden {

/// Returns a datagram as shown in protocol/vectors/golden.md: one line per field with its bytes in hex and their
/// meaning, with the names of tendon.proto.
std::string block(std::span<const std::byte> datagram);

/// Returns the blocks of a page that start with "```golden NAME". NAME is the key.
std::map<std::string, std::string> blocks(std::string_view page);

/// Generates the golden blocks from the examples in examples.h that have these names. Throws std::invalid_argument if
/// the sets of names differ.
std::string rewritten(std::string_view page);

}  // namespace tendon::golden
