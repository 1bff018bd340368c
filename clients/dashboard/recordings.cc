// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/recordings.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <utility>

#include "protocol/wire/text.h"

namespace tendon::dash {
namespace {

bool is_plain_text(std::string_view text) noexcept {
  while (!text.empty()) {
    const std::size_t size = utf8_character(text);
    if (size == 0 || static_cast<unsigned char>(text[0]) < 0x20 || text[0] == 0x7F) return false;
    text.remove_prefix(size);
  }
  return true;
}

constexpr std::string_view kEnding = ".mcap";

bool is_name(std::string_view name) {
  return name.size() > kEnding.size() && name.ends_with(kEnding) && !name.starts_with('.') &&
         name.find('/') == std::string_view::npos && is_plain_text(name);
}

std::optional<std::uint64_t> number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

OpenFile::OpenFile(OpenFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_) {}

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  size_ = other.size_;
  return *this;
}

OpenFile::~OpenFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::string OpenFile::read(std::uint64_t offset, std::size_t most) const {
  std::string bytes(most, '\0');
  const ssize_t got = ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
  bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
  return bytes;
}

Recordings::Recordings(std::filesystem::path folder) : folder_(std::move(folder)) {
  if (!std::filesystem::is_directory(folder_)) throw std::runtime_error(folder_.string() + ": not a folder");
}

std::vector<Recordings::Entry> Recordings::list() const {
  std::vector<Entry> entries;
  std::error_code gone;  // files may be removed at any time
  for (auto file = std::filesystem::directory_iterator(folder_, gone); file != std::filesystem::directory_iterator();
       file.increment(gone)) {
    std::string name = file->path().filename().string();
    struct stat status {};
    if (!is_name(name) || ::lstat(file->path().c_str(), &status) != 0 || !S_ISREG(status.st_mode)) continue;
    entries.push_back(
        {std::move(name), static_cast<std::uint64_t>(status.st_size),
         static_cast<double>(status.st_mtim.tv_sec) + 1e-9 * static_cast<double>(status.st_mtim.tv_nsec)});
  }
  std::ranges::sort(entries, [](const Entry& a, const Entry& b) {
    return std::pair(-a.modified_unix_s, std::string_view(a.name)) <
           std::pair(-b.modified_unix_s, std::string_view(b.name));
  });
  if (entries.size() > kMaxListed) entries.resize(kMaxListed);
  return entries;
}

std::optional<OpenFile> Recordings::open(std::string_view name) const {
  if (!is_name(name)) return std::nullopt;
  const int descriptor = ::open((folder_ / name).c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return std::nullopt;
  struct stat status {};
  const bool regular = ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode);
  OpenFile file(descriptor, static_cast<std::uint64_t>(status.st_size));
  if (!regular) return std::nullopt;
  return file;
}

std::variant<WholeFile, ByteRange, Unsatisfiable> parse_range(std::string_view header, std::uint64_t size) {
  constexpr std::string_view kUnit = "bytes=";
  if (!header.starts_with(kUnit)) return WholeFile{};
  header.remove_prefix(kUnit.size());
  const auto dash = header.find('-');
  if (dash == std::string_view::npos) return WholeFile{};
  const std::string_view before = header.substr(0, dash);
  const std::string_view after = header.substr(dash + 1);
  const auto first = number(before);
  const auto last = number(after);
  if ((!before.empty() && !first) || (!after.empty() && !last) || (!first && !last)) return WholeFile{};
  if (!first) {  // "-N": the last N bytes
    if (*last == 0 || size == 0) return Unsatisfiable{};
    const std::uint64_t count = std::min(*last, size);
    return ByteRange{size - count, count};
  }
  if (last && *last < *first) return WholeFile{};
  if (*first >= size) return Unsatisfiable{};
  const std::uint64_t end = last && *last < size - 1 ? *last + 1 : size;
  return ByteRange{*first, end - *first};
}

}  // namespace tendon::dash
