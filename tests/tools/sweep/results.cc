// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/sweep/results.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <system_error>

namespace tendon::sweep {
namespace {

/// Temporary file of this process; closed and removed on destruction.
class Draft {
 public:
  explicit Draft(const std::filesystem::path& beside) {
    static std::atomic<unsigned> count{0};
    char host[256] = "";
    gethostname(host, sizeof host - 1);
    path_ = beside.parent_path() / ("." + beside.filename().string() + "." + host + "." + std::to_string(getpid()) +
                                    "." + std::to_string(count++));
    file_ = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (file_ < 0) fail("cannot write");
  }
  ~Draft() {
    if (file_ >= 0) close(file_);
    unlink(path_.c_str());
  }
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;

  void write(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = ::write(file_, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail("cannot write");
      text.remove_prefix(static_cast<std::size_t>(written));
    }
  }

  void sync() const {
    if (fsync(file_) != 0) fail("cannot sync");
  }

  /// Over NFS the reply to a successful link may be lost, so the link count decides.
  bool link_to(const std::filesystem::path& name) const {
    if (link(path_.c_str(), name.c_str()) == 0) return true;
    const int reason = errno;
    struct stat now {};
    if (fstat(file_, &now) == 0 && now.st_nlink == 2) return true;
    if (reason == EEXIST) return false;
    errno = reason;
    fail("cannot link it to " + name.string());
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::system_error(errno, std::generic_category(), path_.string() + ": " + what);
  }

  std::filesystem::path path_;
  int file_ = -1;
};

void sync_folder(const std::filesystem::path& folder) {
  const int file = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (file < 0 || fsync(file) != 0) {
    const int reason = errno;
    if (file >= 0) close(file);
    throw std::system_error(reason, std::generic_category(), folder.string() + ": cannot sync");
  }
  close(file);
}

std::string six_digits(std::uint64_t shard) {
  const std::string number = std::to_string(shard);
  return std::string(number.size() < 6 ? 6 - number.size() : 0, '0') + number;
}

}  // namespace

std::string contents_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + ": cannot read the file");
  return {std::istreambuf_iterator<char>(in), {}};
}

std::filesystem::path result_file(const std::filesystem::path& folder, std::uint64_t shard) {
  return folder / "done" / (six_digits(shard) + ".json");
}

std::filesystem::path failure_file(const std::filesystem::path& folder, std::uint64_t shard) {
  return folder / "failed" / (six_digits(shard) + ".log");
}

Kept keep(const std::filesystem::path& file, std::string_view text) {
  std::filesystem::create_directories(file.parent_path());
  const Draft draft(file);
  draft.write(text);
  draft.sync();
  if (draft.link_to(file)) {
    sync_folder(file.parent_path());
    return Kept::kNew;
  }
  return contents_of(file) == text ? Kept::kSame : Kept::kOther;
}

Kept keep_result(const std::filesystem::path& folder, std::uint64_t shard, std::string_view text) {
  const std::filesystem::path file = result_file(folder, shard);
  const Kept kept = keep(file, text);
  if (kept == Kept::kOther) {
    std::filesystem::path beside = file;
    keep(beside.replace_extension(".differs"), text);
  }
  return kept;
}

namespace {

std::optional<std::string> result_in(const std::filesystem::path& file, const Units& units) {
  if (!std::filesystem::exists(file)) return std::nullopt;
  std::string text = contents_of(file);
  try {
    end_of(text, units);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(file.string() + ": " + error.what());
  }
  return text;
}

std::map<std::uint64_t, std::string> lines_by_unit(std::string_view output) {
  std::map<std::uint64_t, std::string> lines;
  while (!output.empty()) {
    const std::string_view line = output.substr(0, output.find('\n') + 1);
    if (const auto unit = unit_of(line)) lines[*unit] += line;
    output.remove_prefix(line.size());
  }
  return lines;
}

}  // namespace

std::optional<std::string> result_of(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard) {
  return result_in(result_file(folder, shard), plan.shard(shard));
}

std::optional<std::string> other_result_of(const std::filesystem::path& folder, const Plan& plan, std::uint64_t shard) {
  return result_in(result_file(folder, shard).replace_extension(".differs"), plan.shard(shard));
}

std::string lines_of(std::string_view output, std::uint64_t unit) {
  const auto lines = lines_by_unit(output);
  const auto found = lines.find(unit);
  return found == lines.end() ? "" : found->second;
}

std::vector<std::uint64_t> differing_units(std::string_view one, std::string_view other, const Units& units) {
  const auto lines = lines_by_unit(one);
  const auto others = lines_by_unit(other);
  std::vector<std::uint64_t> differing;
  for (std::uint64_t unit = units.first; unit < units.first + units.count; ++unit) {
    const auto here = lines.find(unit);
    const auto there = others.find(unit);
    const bool same = here == lines.end() || there == others.end() ? (here == lines.end()) == (there == others.end())
                                                                   : here->second == there->second;
    if (!same) differing.push_back(unit);
  }
  if (!differing.empty()) return differing;
  const auto told = end_of(one, units).digest.differs_at(end_of(other, units).digest, units);
  if (told) differing.push_back(*told);
  return differing;
}

std::string difference(std::string_view one, std::string_view other, const Units& units) {
  const std::vector<std::uint64_t> differing = differing_units(one, other, units);
  if (differing.empty()) {
    return end_of(one, units).digest == end_of(other, units).digest ? "no unit, but in their last lines"
                                                                    : "several units";
  }
  constexpr std::size_t kMost = 8;
  std::string text = differing.size() == 1 ? "unit " : "units ";
  for (std::size_t i = 0; i < differing.size() && i < kMost; ++i) {
    text += (i == 0 ? "" : ", ") + std::to_string(differing[i]);
  }
  if (differing.size() > kMost) text += " and " + std::to_string(differing.size() - kMost) + " more";
  return text;
}

ShardEnd end_of(std::string_view output, const Units& units) {
  if (output.empty() || output.back() != '\n') throw std::invalid_argument("the output is truncated");
  output.remove_suffix(1);
  const auto last = output.rfind('\n');
  const ShardEnd end = ShardEnd::parse(last == std::string_view::npos ? output : output.substr(last + 1));
  if (end.units != units) {
    throw std::invalid_argument("the end of units " + std::to_string(end.units.first) + ":" +
                                std::to_string(end.units.count) + ", expected that of " + std::to_string(units.first) +
                                ":" + std::to_string(units.count));
  }
  return end;
}

Status status_of(const std::filesystem::path& folder, const Plan& plan) {
  Status status{.shards = plan.shards()};
  for (std::uint64_t shard = 0; shard < status.shards; ++shard) {
    std::filesystem::path file = result_file(folder, shard);
    if (!std::filesystem::exists(file)) {
      status.missing.push_back(shard);
      if (std::filesystem::exists(failure_file(folder, shard))) status.failed.push_back(shard);
      continue;
    }
    ++status.done;
    if (std::filesystem::exists(file.replace_extension(".differs"))) status.differing.push_back(shard);
  }
  return status;
}

std::string ranges(const std::vector<std::uint64_t>& numbers) {
  std::string text;
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t last = i;
    while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
    text += (text.empty() ? "" : ",") + std::to_string(numbers[i]);
    if (last > i) text += "-" + std::to_string(numbers[last]);
    i = last + 1;
  }
  return text;
}

}  // namespace tendon::sweep
