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

/// A file opened for reading. Its size is that at the time of opening, because recordings may still grow.
class OpenFile {
 public:
  OpenFile(int descriptor, std::uint64_t size) noexcept : descriptor_(descriptor), size_(size) {}
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&& other) noexcept;
  ~OpenFile();

  std::uint64_t size() const noexcept { return size_; }
  /// Reads at most `most` bytes at `offset`. Returns fewer bytes at the end of the file and none after an error.
  std::string read(std::uint64_t offset, std::size_t most) const;

 private:
  int descriptor_;
  std::uint64_t size_;
};

/// The recordings (*.mcap) in one folder, without subfolders. Names cannot refer to files outside of the folder.
/// Thread-safe: no. Realtime-safe: no (file access).
class Recordings {
 public:
  struct Entry {
    std::string name;
    std::uint64_t size = 0;      ///< bytes
    double modified_unix_s = 0;  ///< s since 1970-01-01
  };
  static constexpr std::size_t kMaxListed = 1000;  ///< only the newest recordings are listed

  explicit Recordings(std::filesystem::path folder);  ///< throws std::runtime_error "runs: not a folder"

  std::vector<Entry> list() const;  ///< newest first

  /// Opens a recording; nullopt if `name` has a slash, is hidden, not *.mcap, a symbolic link or no regular file.
  std::optional<OpenFile> open(std::string_view name) const;

 private:
  std::filesystem::path folder_;
};

struct ByteRange {  // [first, first + count) of a file
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

/// Parses a Range header (RFC 9110, 14.2) for a file of `size` bytes. Headers with several ranges, another unit or
/// invalid syntax select the whole file, as the RFC allows.
std::variant<WholeFile, ByteRange, Unsatisfiable> parse_range(std::string_view header, std::uint64_t size);

}  // namespace tendon::dash
