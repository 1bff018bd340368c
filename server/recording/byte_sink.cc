// SPDX-License-Identifier: Apache-2.0
#include "server/recording/byte_sink.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "server/machine/regular_file.h"

namespace tendon {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

}  // namespace

bool MemorySink::append(std::span<const std::byte> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return true;
}

/// The descriptor is negative if the file is not empty or is used by another sink.
FileSink::Opened FileSink::open(const std::filesystem::path& path) {
  const auto fail = [&path](const std::string& why) {
    throw std::runtime_error("cannot write recording " + path.string() + ": " + why);
  };
  // O_APPEND because incomplete pieces may be removed. O_NONBLOCK so that opening a pipe does not wait for its reader.
  constexpr int kFlags = O_WRONLY | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY;
  int descriptor = ::open(path.c_str(), kFlags | O_CREAT | O_EXCL, 0644);
  if (descriptor < 0 && errno == EEXIST) descriptor = ::open(path.c_str(), kFlags);
  const int error = errno;
  struct stat status {};
  const bool known = (descriptor >= 0 ? ::fstat(descriptor, &status) : ::stat(path.c_str(), &status)) == 0;
  const auto give_up = [&](const std::string& why) {
    if (descriptor >= 0) ::close(descriptor);
    fail(why);
  };
  if (known && !S_ISCHR(status.st_mode)) {
    if (const auto why = why_not_regular(status.st_mode)) give_up(*why);
  }
  if (descriptor < 0) fail(reason(error));
  if (!known) give_up(reason(errno));
  if (S_ISCHR(status.st_mode)) return {descriptor, false};
  // Checked again after locking, because another sink may have written to it.
  const bool busy = ::flock(descriptor, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (!busy && ::fstat(descriptor, &status) == 0 && status.st_size == 0) return {descriptor, true};
  ::close(descriptor);
  return {-1, true};
}

FileSink::FileSink(const std::filesystem::path& path, const Opened& opened)
    : path_(path), descriptor_(opened.descriptor), is_file_(opened.is_file) {}

FileSink::FileSink(const std::filesystem::path& path) : FileSink(path, open(path)) {
  if (descriptor_ < 0) {
    throw std::runtime_error("cannot write recording " + path_.string() + ": the file already exists");
  }
}

std::unique_ptr<FileSink> FileSink::open_new(const std::filesystem::path& path) {
  const Opened opened = open(path);
  if (opened.descriptor < 0) return nullptr;
  return std::unique_ptr<FileSink>(new FileSink(path, opened));
}

FileSink::~FileSink() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

bool FileSink::append(std::span<const std::byte> bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const auto n = ::write(descriptor_, bytes.data() + done, bytes.size() - done);
    if (n > 0) {
      done += static_cast<std::size_t>(n);
      continue;
    }
    if (n < 0 && errno == EINTR) continue;
    error_ = "cannot write recording " + path_.string() + ": " + reason(n < 0 ? errno : ENOSPC);
    if (done > 0 && ::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0)
      error_ += "; its last part is incomplete and cannot be removed: " + reason(errno);
    return false;
  }
  size_ += done;
  return is_there();
}

bool FileSink::is_there() {
  struct stat status {};
  if (!is_file_ || ::fstat(descriptor_, &status) != 0) return true;
  const bool cut = static_cast<std::uint64_t>(status.st_size) < size_;
  if (status.st_nlink > 0 && !cut) return true;
  gone_ = true;
  error_ =
      "cannot write recording " + path_.string() + ": it was " + (cut ? "truncated" : "deleted") + " in the meantime";
  return false;
}

}  // namespace tendon
