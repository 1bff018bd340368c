// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/mount.h>

#include <cerrno>
#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

namespace tendon::e2e {

/// A tmpfs of `size` bytes that is unmounted by the destructor. Requires the permission to mount.
class SmallDisk {
 public:
  SmallDisk(std::filesystem::path path, const std::string& size) : path_(std::move(path)) {
    std::filesystem::create_directory(path_);
    if (::mount("tendon-test", path_.c_str(), "tmpfs", 0, ("size=" + size).c_str()) != 0) error_ = errno;
  }
  ~SmallDisk() {
    // A lazy unmount works even if a program is still writing to the file system.
    if (error_ == 0) ::umount2(path_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;

  const std::filesystem::path& path() const noexcept { return path_; }
  int error() const noexcept { return error_; }
  /// Root ignores the permissions of files, but not this.
  bool make_read_only() { return ::mount(nullptr, path_.c_str(), nullptr, MS_REMOUNT | MS_RDONLY, nullptr) == 0; }
  std::string why_not() const {
    return "may not mount a small tmpfs here (" + std::system_category().message(error_) +
           "); run as root to test what a full disk does";
  }

 private:
  std::filesystem::path path_;
  int error_ = 0;
};

}  // namespace tendon::e2e
