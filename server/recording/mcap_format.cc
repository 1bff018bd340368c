// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_format.h"

#include <zlib.h>

namespace tendon::mcap {

std::uint32_t extend_crc(std::uint32_t crc, std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace tendon::mcap
