// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/file_bytes.h"

#include <xxhash.h>

#include <fstream>
#include <stdexcept>
#include <system_error>

namespace tendon::softbody {

std::uint64_t checksum(std::string_view bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }

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
