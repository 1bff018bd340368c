// SPDX-License-Identifier: Apache-2.0
#include "server/scene/key_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

namespace tendon {
namespace {

std::string system_message() { return std::generic_category().message(errno); }

/// Closes the descriptor at the end of its scope.
struct Descriptor {
  explicit Descriptor(int descriptor) : fd(descriptor) {}
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int fd;
};

ClientKey read_one(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  std::string text(kMaxKeyFile, '\0');
  const ssize_t size = file.fd < 0 || ::fstat(file.fd, &status) != 0 ? -1 : ::read(file.fd, text.data(), text.size());
  if (size < 0) throw std::runtime_error(path.string() + ": cannot read it: " + system_message());
  text.resize(static_cast<std::size_t>(size));
  try {
    return read_key_file(text, status.st_mode, path.stem().string());
  } catch (const std::invalid_argument& refused) {
    throw std::runtime_error(path.string() + ": " + refused.what());
  }
}

}  // namespace

std::vector<ClientKey> read_key_folder(const std::filesystem::path& folder) {
  std::error_code problem;
  std::vector<std::filesystem::path> files;
  for (std::filesystem::directory_iterator entry(folder, problem), end; !problem && entry != end;
       entry.increment(problem)) {
    if (entry->path().extension() == ".key") files.push_back(entry->path());
  }
  if (problem) throw std::runtime_error(folder.string() + ": cannot read this folder of keys: " + problem.message());
  if (files.empty()) {
    throw std::runtime_error(folder.string() +
                             ": there is no key in this folder; make one for each client with "
                             "`tendond keygen NAME`");
  }
  std::sort(files.begin(), files.end());
  std::vector<ClientKey> keys;
  for (const std::filesystem::path& file : files) keys.push_back(read_one(file));
  return keys;
}

void write_key_file(const std::filesystem::path& path, const ClientKey& key) {
  constexpr mode_t kOwnerOnly = 0600;
  const Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, kOwnerOnly));
  const std::string text = key_file_text(key);
  if (file.fd < 0 || ::write(file.fd, text.data(), text.size()) != static_cast<ssize_t>(text.size()) ||
      ::fsync(file.fd) != 0) {
    throw std::runtime_error(path.string() + ": cannot write this key: " + system_message());
  }
}

}  // namespace tendon
