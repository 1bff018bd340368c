// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

// BLAKE2b without a key (RFC 7693), which is used for identifying data. It is implemented in crypto.cc.

namespace tendon::crypto {

std::array<std::byte, 16> blake2b_128(std::span<const std::byte> message) noexcept;
std::array<std::byte, 32> blake2b_256(std::span<const std::byte> message) noexcept;

}  // namespace tendon::crypto
