// SPDX-License-Identifier: Apache-2.0
#include "server/scene/key_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "server/machine/regular_file.h"

namespace tendon {
namespace {

std::string system_message() { return std::generic_category().message(errno); }

struct Descriptor {
  explicit Descriptor(int descriptor) : fd(descriptor) {}
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int fd;
};

bool write_whole(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0) return false;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

/// Returns false and sets errno if the name is used. NFS cannot rename without overwriting, and FAT has no links.
bool give_name(const std::string& from, const std::filesystem::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL || ::link(from.c_str(), to.c_str()) != 0) return false;
  ::unlink(from.c_str());
  return true;
}

}  // namespace

ClientKey read_key(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  struct stat status {};
  std::string text(kMaxKeyFile, '\0');
  const ssize_t size = file.fd < 0 || ::fstat(file.fd, &status) != 0 ? -1 : ::read(file.fd, text.data(), text.size());
  if (size < 0) throw std::runtime_error("cannot read key file " + path.string() + ": " + system_message());
  if (const auto reason = why_not_regular(status.st_mode)) {
    throw std::runtime_error("cannot read key file " + path.string() + ": " + *reason);
  }
  text.resize(static_cast<std::size_t>(size));
  try {
    return read_key_file(text, status.st_mode, path.stem().string());
  } catch (const std::invalid_argument& refused) {
    throw std::runtime_error(path.string() + ": " + refused.what());
  }
}

std::vector<ClientKey> read_key_folder(const std::filesystem::path& folder) {
  std::error_code problem;
  std::vector<std::filesystem::path> files;
  for (std::filesystem::directory_iterator entry(folder, problem), end; !problem && entry != end;
       entry.increment(problem)) {
    if (entry->path().extension() == ".key") files.push_back(entry->path());
  }
  if (problem) throw std::runtime_error("cannot read key folder " + folder.string() + ": " + problem.message());
  if (files.empty()) {
    throw std::runtime_error(
        folder.string() + ": expected a key file for each client, found none; create one with `tendond keygen NAME`");
  }
  std::sort(files.begin(), files.end());
  std::vector<ClientKey> keys;
  for (const std::filesystem::path& file : files) keys.push_back(read_key(file));
  return keys;
}

void write_key_file(const std::filesystem::path& path, const ClientKey& key) {
  std::string unfinished = path.string() + ".new-XXXXXX";
  const Descriptor file(::mkostemp(unfinished.data(), O_CLOEXEC));  // readable by the owner only
  const bool made =
      file.fd >= 0 && write_whole(file.fd, key_file_text(key)) && ::fsync(file.fd) == 0 && give_name(unfinished, path);
  if (made) return;
  const std::string reason = system_message();
  if (file.fd >= 0) ::unlink(unfinished.c_str());
  throw std::runtime_error("cannot write key file " + path.string() + ": " + reason);
}

}  // namespace tendon
