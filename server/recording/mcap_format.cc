// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_format.h"

#include <zlib.h>

namespace tendon::mcap {

std::uint32_t extend_crc(std::uint32_t crc, std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::uint32_t join_crcs(std::uint32_t crc, std::uint32_t next, std::size_t size) {
  return static_cast<std::uint32_t>(crc32_combine(crc, next, static_cast<z_off_t>(size)));
}

}  // namespace tendon::mcap
