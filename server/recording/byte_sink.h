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

/// The destination of a recording. Data is appended in complete pieces.
///
/// Thread-safe: no. Realtime-safe: no.
class ByteSink {
 public:
  virtual ~ByteSink() = default;

  /// Appends all bytes and returns true. If this is not possible, it returns false and removes the incomplete piece if
  /// it can, so that the data ends with a complete piece.
  virtual bool append(std::span<const std::byte> bytes) = 0;

  /// Returns the error message of the last failed `append`, or an empty string if there was no error.
  virtual std::string error() const = 0;
};

/// Stores a recording in memory. This is used for simulated worlds.
class MemorySink final : public ByteSink {
 public:
  bool append(std::span<const std::byte> bytes) override;
  std::string error() const override { return {}; }
  const std::vector<std::byte>& bytes() const noexcept { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

/// Writes to a new file. Existing data is never modified. Each piece is written immediately, so no data is lost if the
/// process is killed. However, it can be lost in a power failure. If there is not enough space for a piece, the
/// incomplete piece is removed. `append` fails if the file has been deleted or truncated.
///
/// Character devices like /dev/null and /dev/full can be used by several sinks at the same time. Pipes, sockets, block
/// devices and directories are refused, because a recording must be a file, and writing to a pipe could block.
class FileSink final : public ByteSink {
 public:
  /// Creates the file. An empty file can be used if there is no other sink that writes to it. Throws std::runtime_error
  /// if the file is not empty or is not writable.
  explicit FileSink(const std::filesystem::path& path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  /// Like the constructor, but returns null if the file is not empty or is used by another sink.
  static std::unique_ptr<FileSink> open_new(const std::filesystem::path& path);

  bool append(std::span<const std::byte> bytes) override;
  std::string error() const override { return error_; }

  const std::filesystem::path& path() const noexcept { return path_; }
  std::uint64_t size() const noexcept { return size_; }
  /// Returns false for devices.
  bool is_file() const noexcept { return is_file_; }
  /// Returns true if `append` has failed because the file has been deleted or truncated.
  bool gone() const noexcept { return gone_; }

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
