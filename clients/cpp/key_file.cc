// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/key_file.h"

#include <sys/stat.h>

#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace tendon {

ClientKey read_client_key(const std::string& file) {
  struct stat status {};
  std::string text(kMaxKeyFile, '\0');
  std::ifstream stream(file, std::ios::binary);
  if (!stream || ::stat(file.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) {
    throw std::runtime_error(
        file + ": cannot read this key: " + (errno != 0 ? std::generic_category().message(errno) : "not a file"));
  }
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  try {
    return read_key_file(text, status.st_mode, file);
  } catch (const std::invalid_argument& refused) {
    throw std::runtime_error(file + ": " + refused.what());
  }
}

}  // namespace tendon
