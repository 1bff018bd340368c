// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>

namespace tendon::golden {

/// A datagram in the clear as WIRE.md shows it: a line for each field, its bytes in hex, and what they say. Field
/// names, types and enumerators are those of tendon.proto.
std::string block(std::span<const std::byte> datagram);

/// The blocks of a page that open with "```golden NAME", by name.
std::map<std::string, std::string> blocks(std::string_view page);

/// `page` with each of its golden blocks written anew from the example of that name (examples.h). Throws
/// std::invalid_argument when page and examples have not the same names.
std::string rewritten(std::string_view page);

}  // namespace tendon::golden
