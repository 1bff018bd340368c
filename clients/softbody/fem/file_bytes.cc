// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/file_bytes.h"

#include <xxhash.h>

#include <fstream>
#include <stdexcept>
#include <system_error>

namespace tendon::softbody {

std::uint64_t checksum(std::string_view bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

std::string_view without_checksum(std::string_view bytes) {
  const std::string_view body = bytes.substr(0, bytes.size() - sizeof(std::uint64_t));
  if (ByteReader(bytes.substr(body.size())).take<std::uint64_t>() != checksum(body)) {
    throw std::invalid_argument("its checksum does not match");
  }
  return body;
}

void write_draft(const std::filesystem::path& draft, std::string_view bytes) {
  std::ofstream out(draft, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (out) return;
  std::error_code ignored;
  std::filesystem::remove(draft, ignored);
  throw std::runtime_error("cannot write " + draft.string() + ": is the disk full?");
}

}  // namespace tendon::softbody
