// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace tendon {

/// Thread-safe: no. Realtime-safe: no.
class ByteSink {
 public:
  virtual ~ByteSink() = default;

  /// Appends all bytes and returns true. Otherwise, returns false and removes the incomplete piece if possible, so that
  /// the data ends with a complete piece.
  virtual bool append(std::span<const std::byte> bytes) = 0;

  virtual std::string error() const = 0;
};

class MemorySink final : public ByteSink {  ///< for simulated worlds
 public:
  bool append(std::span<const std::byte> bytes) override;
  std::string error() const override { return {}; }
  const std::vector<std::byte>& bytes() const noexcept { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

/// Writes to a new file. Existing data is never modified. Each piece is written immediately, so a killed process loses
/// no data, but a power failure can. If the disk is full, an incomplete piece is removed. Character devices like
/// /dev/null and /dev/full can be used by several sinks. Pipes, sockets, block devices and directories are refused.
class FileSink final : public ByteSink {
 public:
  /// Creates the file, or uses an empty, unused one. Throws std::runtime_error if it is not empty or not writable.
  explicit FileSink(const std::filesystem::path& path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  /// Like the constructor, but returns null if the file is not empty or is in use.
  static std::unique_ptr<FileSink> open_new(const std::filesystem::path& path);

  bool append(std::span<const std::byte> bytes) override;
  std::string error() const override { return error_; }

  const std::filesystem::path& path() const noexcept { return path_; }
  std::uint64_t size() const noexcept { return size_; }
  bool is_file() const noexcept { return is_file_; }  ///< false for devices
  bool gone() const noexcept { return gone_; }        ///< `append` has failed because the file was deleted or truncated

 private:
  struct Opened {
    int descriptor;
    bool is_file;
  };
  FileSink(const std::filesystem::path& path, const Opened& opened);
  static Opened open(const std::filesystem::path& path);
  bool is_there();

  std::filesystem::path path_;
  int descriptor_ = -1;
  bool is_file_ = false;
  bool gone_ = false;
  std::uint64_t size_ = 0;
  std::string error_;
};

}  // namespace tendon
