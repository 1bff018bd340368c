// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace tendon::dash {

/// A file that is open for reading. Its size is that at the time of opening; a file that is still being written grows.
class OpenFile {
 public:
  OpenFile(int descriptor, std::uint64_t size) noexcept : descriptor_(descriptor), size_(size) {}
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&& other) noexcept;
  ~OpenFile();

  std::uint64_t size() const noexcept { return size_; }
  /// Bytes read from `offset` on, at most `most`; fewer at the end, none after an error.
  std::string read(std::uint64_t offset, std::size_t most) const;

 private:
  int descriptor_;
  std::uint64_t size_;
};

/// The recordings (*.mcap) of one folder, without its subfolders. No name leads out of the folder.
///
/// Thread-safe: no. Realtime-safe: no (files).
class Recordings {
 public:
  struct Entry {
    std::string name;
    std::uint64_t size = 0;      ///< bytes
    double modified_unix_s = 0;  ///< s since 1970
  };
  /// The most recordings that are listed, the newest ones: a page is no file manager.
  static constexpr std::size_t kMaxListed = 1000;

  /// Throws std::runtime_error when `folder` is not a folder: "runs: not a folder".
  explicit Recordings(std::filesystem::path folder);

  /// The newest first.
  std::vector<Entry> list() const;

  /// Opens a recording. Empty when `name` has a slash, is hidden, is not *.mcap, or names a symbolic link or no regular
  /// file.
  std::optional<OpenFile> open(std::string_view name) const;

 private:
  std::filesystem::path folder_;
};

/// The bytes [first, first + count) of a file.
struct ByteRange {
  std::uint64_t first = 0;
  std::uint64_t count = 0;
  bool operator==(const ByteRange&) const = default;
};
struct WholeFile {
  bool operator==(const WholeFile&) const = default;
};
struct Unsatisfiable {
  bool operator==(const Unsatisfiable&) const = default;
};

/// The bytes that a Range header (RFC 9110, 14.2) asks for, of a file of `size` bytes. A header with several ranges,
/// with another unit, or that cannot be read is ignored, as the RFC allows: the whole file.
std::variant<WholeFile, ByteRange, Unsatisfiable> parse_range(std::string_view header, std::uint64_t size);

}  // namespace tendon::dash
