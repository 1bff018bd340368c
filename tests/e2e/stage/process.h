// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace tendon::e2e {

/// How long a test waits for anything before it fails. Nothing here takes longer than a few seconds; virtual machines
/// pause, and builds run beside us.
inline constexpr std::chrono::seconds kPatience{30};

/// A running program, what it has said so far, and how it ended. It is gone when this object is.
///
/// What the program says is read only while one of the two waits below waits: it must not say more than fits into a
/// pipe (64 kB) in between.
///
/// A wait throws std::runtime_error with the program's whole output when patience runs out or the wait became futile.
///
/// Thread-safe: no.
class Process {
 public:
  /// Starts `program` in `folder`, with no standard input and, beside our own environment, `more_environment`
  /// ("NAME=value"). Throws std::system_error when it cannot be started.
  Process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
          const std::filesystem::path& folder, std::vector<std::string> more_environment = {});
  /// SIGKILL, when it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// The next line of stdout or stderr with `text` in it. On that stream, later calls begin after it.
  std::string wait_for_line(std::string_view text, std::chrono::nanoseconds patience = kPatience);

  void signal(int number);
  pid_t pid() const noexcept { return pid_; }

  /// Waits for the end. Returns the exit code, or −N when signal N has ended it.
  int wait(std::chrono::nanoseconds patience = kPatience);

  /// All output so far.
  const std::string& out() const noexcept { return out_.text; }
  const std::string& err() const noexcept { return err_.text; }

 private:
  using Deadline = std::chrono::steady_clock::time_point;
  struct Stream {
    int fd = -1;  ///< −1 after its end
    std::string text;
    std::size_t next = 0;  ///< where wait_for_line goes on
  };

  static std::optional<std::string> next_line(Stream& stream, std::string_view text);
  static void read_some(Stream& stream);
  bool ended() const noexcept { return out_.fd < 0 && err_.fd < 0; }
  void listen(Deadline deadline, const std::string& awaited);
  [[noreturn]] void give_up(const std::string& why) const;

  std::string name_;
  pid_t pid_ = 0;
  Stream out_;
  Stream err_;
  std::optional<int> exit_code_;
};

}  // namespace tendon::e2e
