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

/// Where the bytes of a recording go. Takes them in order, in whole pieces.
///
/// Thread-safe: no. Realtime-safe: no.
class ByteSink {
 public:
  virtual ~ByteSink() = default;

  /// Adds all of `bytes` at the end and returns true; or returns false and leaves, as far as it can,
  /// nothing of them, so that what is there ends with a whole piece.
  virtual bool append(std::span<const std::byte> bytes) = 0;

  /// Why the last `append` failed, as a sentence for the operator. Empty when none has.
  virtual std::string error() const = 0;
};

/// Bytes in memory: recordings of simulated worlds.
class MemorySink final : public ByteSink {
 public:
  bool append(std::span<const std::byte> bytes) override;
  std::string error() const override { return {}; }
  const std::vector<std::byte>& bytes() const noexcept { return bytes_; }

 private:
  std::vector<std::byte> bytes_;
};

/// A new file. Existing files are not changed. Each piece is handed to the kernel at once: a killed
/// process loses none of them (a power cut may). A piece that does not fit on the disk is cut off again. `append` fails
/// if the file has been deleted or truncated.
///
/// It also writes to devices that keep nothing (/dev/null, /dev/full), which any number of sinks may share. A pipe, a
/// socket, a block device and a folder are refused: a recording is a file, and a pipe that nobody reads would hang.
class FileSink final : public ByteSink {
 public:
  /// Makes the file; takes over an empty one that no other sink writes to. Throws std::runtime_error with path and
  /// reason when there is something in it already, or it cannot be written to.
  explicit FileSink(const std::filesystem::path& path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  /// As the constructor; null when the file exists and has something in it, or is another sink's.
  static std::unique_ptr<FileSink> open_new(const std::filesystem::path& path);

  bool append(std::span<const std::byte> bytes) override;
  std::string error() const override { return error_; }

  const std::filesystem::path& path() const noexcept { return path_; }
  std::uint64_t size() const noexcept { return size_; }
  /// It is a file on a disk, and not a device.
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
