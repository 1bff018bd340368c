// SPDX-License-Identifier: Apache-2.0
#include "server/recording/part_files.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <variant>

#include "server/recording/mcap_format.h"
#include "server/recording/recording_reader.h"

namespace tendon {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kRoom = std::uint64_t{16} << 20;

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

fs::path numbered(const fs::path& path, std::uint64_t number) {
  fs::path part = path;
  return part.replace_filename(path.stem().string() + "-" + std::to_string(number) + path.extension().string());
}

/// Returns the number of a part, which is 1 for `path`, or nothing if the file is not a part.
std::optional<std::uint64_t> number_of(const fs::path& path, const fs::path& file) {
  const std::string name = file.filename().string();
  if (name == path.filename()) return 1;
  const std::string before = path.stem().string() + "-";
  const std::string after = path.extension().string();
  if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after)) return {};
  const std::string_view digits =
      std::string_view(name).substr(before.size(), name.size() - before.size() - after.size());
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || end != digits.data() + digits.size() || number < 2 || digits.front() == '0') return {};
  return number;
}

struct Part {
  fs::path path;
  std::uint64_t number;
  fs::file_time_type written;
  std::uint64_t bytes;
};

std::vector<Part> parts_of(const fs::path& path) {
  std::vector<Part> parts;
  std::error_code error;
  for (fs::directory_iterator entry(folder_of(path), error), end; !error && entry != end; entry.increment(error)) {
    const auto number = number_of(path, entry->path());
    std::error_code gone;
    if (!number || !entry->is_regular_file(gone) || gone) continue;
    const auto written = entry->last_write_time(gone);
    const auto bytes = entry->file_size(gone);
    if (!gone) parts.push_back({folder_of(path) / entry->path().filename(), *number, written, bytes});
  }
  return parts;
}

/// Returns true if the file is a recording, an incomplete one, or not readable.
bool looks_like_a_recording(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return true;
  std::array<char, mcap::kMagic.size()> head{};
  file.read(head.data(), head.size());
  const auto size = static_cast<std::size_t>(file.gcount());
  return std::equal(head.begin(), head.begin() + static_cast<std::ptrdiff_t>(size), mcap::kMagic.begin(),
                    [](char a, std::byte b) { return static_cast<std::byte>(a) == b; });
}

std::optional<SceneRecord> scene_of(const fs::path& part) {
  try {
    RecordingReader reader(part);
    auto first = reader.next();
    auto* scene = first ? std::get_if<SceneRecord>(&*first) : nullptr;
    return scene != nullptr ? std::optional(std::move(*scene)) : std::nullopt;
  } catch (const std::runtime_error&) {
    return std::nullopt;
  }
}

/// Returns true if the Scene of `part` allows deleting it to meet the budget of the recording `path`.
bool may_be_deleted(const fs::path& part, const fs::path& path) {
  const auto scene = scene_of(part);
  return scene && scene->budget_bytes > 0 && scene->first_part == path.filename();
}

bool is_of_another(const fs::path& part, const fs::path& path) {
  const auto scene = scene_of(part);
  return scene && !scene->first_part.empty() && scene->first_part != path.filename();
}

bool is_in_use(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return true;
  const bool busy = ::flock(descriptor, LOCK_EX | LOCK_NB) != 0;
  ::close(descriptor);
  return busy;
}

}  // namespace

std::unique_ptr<FileSink> open_next_part(const fs::path& path) {
  std::uint64_t highest = 1;
  for (const Part& part : parts_of(path)) {
    if (part.number > highest && !is_of_another(part.path, path)) highest = part.number;
  }
  if (highest == 1) {
    if (auto sink = FileSink::open_new(path)) return sink;
  }
  if (fs::exists(path) && !looks_like_a_recording(path)) {
    throw std::runtime_error("cannot write recording " + path.string() +
                             ": the file exists and is not a recording; it was not changed");
  }
  for (;;) {
    if (auto sink = FileSink::open_new(numbered(path, ++highest))) return sink;
  }
}

std::vector<fs::path> delete_oldest_parts(const fs::path& path, std::uint64_t most_bytes) {
  std::vector<Part> parts = parts_of(path);
  std::erase_if(parts, [&](const Part& part) { return !may_be_deleted(part.path, path) || is_in_use(part.path); });
  std::sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) {
    return std::pair(a.written, a.number) < std::pair(b.written, b.number);
  });
  std::uint64_t all = 0;
  for (const Part& part : parts) all += part.bytes;
  std::vector<fs::path> deleted;
  for (const Part& part : parts) {
    if (all <= most_bytes) break;
    std::error_code refused;
    if (!fs::remove(part.path, refused)) continue;
    all -= part.bytes;
    deleted.push_back(part.path);
  }
  return deleted;
}

bool has_room(const fs::path& path) {
  struct statvfs disk {};
  if (::statvfs(folder_of(path).c_str(), &disk) != 0) return true;
  return disk.f_bavail * disk.f_frsize >= kRoom;
}

}  // namespace tendon
