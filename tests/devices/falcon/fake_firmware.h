// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tendon {

/// An image that the loader accepts: the key and arbitrary bytes. (Novint's firmware is not in this repository.)
inline std::vector<std::uint8_t> fake_firmware(std::size_t size) {
  std::vector<std::uint8_t> bytes(size);
  std::uint32_t state = 1;
  for (auto& byte : bytes) {
    state = state * 1664525U + 1013904223U;
    byte = static_cast<std::uint8_t>(state >> 24);
  }
  if (size > 1) bytes[0] = 0xAA, bytes[1] = 0x08;
  return bytes;
}

/// The SHA-256 of fake_firmware(8192), as computed by a different program.
inline constexpr const char* kFakeFirmwareSha256 = "5372ece9bb03f00dba6ccd932dbe71118da29143ebbc46c3055e97f0d694c4bd";

}  // namespace tendon
