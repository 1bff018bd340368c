// SPDX-License-Identifier: Apache-2.0
#include "server/machine/regular_file.h"

#include <sys/stat.h>

#include <cerrno>
#include <system_error>

namespace tendon {

std::optional<std::string> why_not_regular(mode_t mode) {
  const auto found = [](const char* what) { return std::string("it is a ") + what + ", expected a regular file"; };
  if (S_ISREG(mode)) return std::nullopt;
  if (S_ISDIR(mode)) return std::generic_category().message(EISDIR);
  if (S_ISFIFO(mode)) return found("named pipe");
  if (S_ISSOCK(mode)) return found("socket");
  return found("device");
}

std::ifstream open_regular_file(const std::filesystem::path& file, std::string_view kind) {
  const auto refuse = [&](const std::string& reason) {
    throw UnreadableFile("cannot read " + std::string(kind) + (kind.empty() ? "" : " ") + file.string() + ": " +
                         reason);
  };
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) refuse(std::generic_category().message(errno));
  if (const auto reason = why_not_regular(status.st_mode)) refuse(*reason);
  std::ifstream stream(file, std::ios::binary);
  if (!stream) refuse(std::generic_category().message(errno));
  return stream;
}

}  // namespace tendon
