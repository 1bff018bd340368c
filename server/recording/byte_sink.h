// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
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

/// A file, created or emptied. Each piece is handed to the kernel at once: a killed process loses none of
/// them (a power cut may). A piece that does not fit on the disk is cut off again.
class FileSink final : public ByteSink {
 public:
  /// Throws std::runtime_error with path and reason when the file cannot be written to, or is the recording of
  /// another server that still runs.
  explicit FileSink(std::filesystem::path path);
  ~FileSink() override;
  FileSink(const FileSink&) = delete;
  FileSink& operator=(const FileSink&) = delete;

  bool append(std::span<const std::byte> bytes) override;
  std::string error() const override { return error_; }

 private:
  std::filesystem::path path_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  std::string error_;
};

}  // namespace tendon
