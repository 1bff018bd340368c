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

namespace tendon {
namespace {

std::string reason(int error) { return std::generic_category().message(error); }

}  // namespace

bool MemorySink::append(std::span<const std::byte> bytes) {
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  return true;
}

FileSink::FileSink(std::filesystem::path path) : path_(std::move(path)) {
  // O_APPEND: after a piece has been cut off, the next one starts where the file ends.
  descriptor_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (descriptor_ < 0) throw std::runtime_error("cannot write recording " + path_.string() + ": " + reason(errno));
  // A pipe or /dev/null has nothing to lose, and others may write to it.
  struct stat status {};
  if (::fstat(descriptor_, &status) == 0 && !S_ISREG(status.st_mode)) return;
  // Emptied only once it is ours: the recording of another server that still runs is not.
  const bool busy = ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (!busy && ::ftruncate(descriptor_, 0) == 0) return;
  const std::string why = busy ? "another recording is being written to it" : reason(errno);
  ::close(descriptor_);
  throw std::runtime_error("cannot write recording " + path_.string() + ": " + why);
}

FileSink::~FileSink() { ::close(descriptor_); }

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
      error_ += "; its last piece is torn and cannot be cut off: " + reason(errno);
    return false;
  }
  size_ += done;
  return true;
}

}  // namespace tendon
