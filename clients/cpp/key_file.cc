// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/key_file.h"

#include <sys/stat.h>

#include <cerrno>
#include <fstream>
#include <stdexcept>
#include <system_error>

namespace tendon {

ClientKey read_client_key(const std::string& file) {
  const auto refuse = [&](const std::string& why) {
    throw std::runtime_error("cannot read key file " + file + ": " + why);
  };
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) refuse(std::generic_category().message(errno));
  // Check before opening, because opening a pipe would block.
  if (!S_ISREG(status.st_mode)) refuse(S_ISDIR(status.st_mode) ? "it is a folder" : "it is not a regular file");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) refuse(std::generic_category().message(errno));
  std::string text(kMaxKeyFile, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  try {
    return read_key_file(text, status.st_mode, file);
  } catch (const std::invalid_argument& refused) {
    throw std::runtime_error(file + ": " + refused.what());
  }
}

}  // namespace tendon
