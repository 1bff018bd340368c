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

/// The timeout of every wait. It is long because machines pause, and because builds may be run in parallel.
inline constexpr std::chrono::seconds kPatience{30};

/// Killed by the destructor. The output is read only during wait_for_line() and wait(), so between them the program
/// must not write more than a pipe holds (64 kB). Both throw std::runtime_error with the whole output on a timeout or
/// if the wait cannot succeed any more. Thread-safe: no.
class Process {
 public:
  /// Starts the program in `folder` without stdin. `more_environment`: "NAME=value". Throws std::system_error.
  Process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
          const std::filesystem::path& folder, std::vector<std::string> more_environment = {});
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Waits for the next line of stdout or stderr that contains `text`. Later calls search that stream after this line.
  std::string wait_for_line(std::string_view text, std::chrono::nanoseconds patience = kPatience);

  void signal(int number);
  pid_t pid() const noexcept { return pid_; }

  /// Waits for the program. Returns its exit code, or −N if signal N ended it.
  int wait(std::chrono::nanoseconds patience = kPatience);

  const std::string& out() const noexcept { return out_.text; }
  const std::string& err() const noexcept { return err_.text; }

 private:
  using Deadline = std::chrono::steady_clock::time_point;
  struct Stream {
    int fd = -1;  ///< −1 after its end
    std::string text;
    std::size_t next = 0;
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
