// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/sweep/child.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>
#include <system_error>

namespace tendon::sweep {
namespace {

constexpr std::size_t kLastErrors = 4096;

/// The environment of this process with some variables replaced, as an array for exec.
class Environment {
 public:
  explicit Environment(const std::vector<std::string>& added) : added_(added) {
    for (char** one = environ; *one != nullptr; ++one) {
      const std::string_view variable = *one;
      const std::string_view name = variable.substr(0, variable.find('=') + 1);
      bool again = false;
      for (const std::string& mine : added_) again = again || mine.starts_with(name);
      if (!again) pointers_.push_back(*one);
    }
    for (std::string& mine : added_) pointers_.push_back(mine.data());
    pointers_.push_back(nullptr);
  }
  char** data() { return pointers_.data(); }

 private:
  std::vector<std::string> added_;
  std::vector<char*> pointers_;
};

struct Pipe {
  std::array<int, 2> ends{-1, -1};

  Pipe() {
    if (pipe2(ends.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
  }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  void close_end(std::size_t which) {
    if (ends.at(which) >= 0) close(ends.at(which));
    ends.at(which) = -1;
  }
  /// The available bytes; closes the reading end at end of file.
  void take(std::string& text) {
    std::array<char, 65536> buffer;
    const ssize_t read = ::read(ends[0], buffer.data(), buffer.size());
    if (read > 0) {
      text.append(buffer.data(), static_cast<std::size_t>(read));
    } else if (read == 0 || errno != EINTR) {
      close_end(0);
    }
  }
};

pid_t start(const Child& child, const Pipe* output, const Pipe* errors) {
  Environment environment(child.environment);
  std::vector<std::string> command = child.command;
  std::vector<char*> arguments;
  for (std::string& one : command) arguments.push_back(one.data());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  if (output != nullptr) posix_spawn_file_actions_adddup2(&files, output->ends[1], STDOUT_FILENO);
  if (errors != nullptr) posix_spawn_file_actions_adddup2(&files, errors->ends[1], STDERR_FILENO);
  pid_t pid = 0;
  const int failed = posix_spawnp(&pid, arguments[0], &files, nullptr, arguments.data(), environment.data());
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) throw std::system_error(failed, std::generic_category(), child.command[0] + ": cannot start");
  return pid;
}

int wait_for(pid_t pid) {
  int status = 0;
  while (waitpid(pid, &status, 0) < 0) {
    if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "waitpid");
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

std::string ChildEnd::text() const {
  return status > 128 ? "signal " + std::to_string(status - 128) : "exit status " + std::to_string(status);
}

ChildEnd run(const Child& child) {
  Pipe output;
  Pipe errors;
  const pid_t pid = start(child, &output, &errors);
  output.close_end(1);
  errors.close_end(1);
  ChildEnd end;
  while (output.ends[0] >= 0 || errors.ends[0] >= 0) {
    std::array<pollfd, 2> waiting = {pollfd{.fd = output.ends[0], .events = POLLIN, .revents = 0},
                                     pollfd{.fd = errors.ends[0], .events = POLLIN, .revents = 0}};
    if (poll(waiting.data(), waiting.size(), -1) < 0) continue;
    if (waiting[0].revents != 0) output.take(end.output);
    if (waiting[1].revents != 0) errors.take(end.errors);
    if (end.errors.size() > 2 * kLastErrors) end.errors.erase(0, end.errors.size() - kLastErrors);
  }
  end.status = wait_for(pid);
  return end;
}

int run_aloud(const Child& child) { return wait_for(start(child, nullptr, nullptr)); }

}  // namespace tendon::sweep
