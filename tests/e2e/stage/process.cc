// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/stage/process.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace tendon::e2e {
namespace {

constexpr std::size_t kShown = 4000;

[[noreturn]] void fail(int error, const std::string& what) {
  throw std::system_error(error, std::system_category(), what);
}

struct Pipe {
  int read = -1;
  int write = -1;
};

/// O_CLOEXEC ensures that no other program inherits the descriptors.
Pipe make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail(errno, "pipe2");
  return {ends[0], ends[1]};
}

std::string end_of(const std::string& text) {
  return text.size() <= kShown ? text : "…" + text.substr(text.size() - kShown);
}

}  // namespace

Process::Process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                 const std::filesystem::path& folder, std::vector<std::string> more_environment)
    : name_(program.filename().string()) {
  std::vector<std::string> words = arguments;
  words.insert(words.begin(), program.string());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::vector<char*> environment;
  // If a name is defined twice, the first definition is used.
  for (std::string& variable : more_environment) environment.push_back(variable.data());
  for (char** variable = environ; *variable != nullptr; ++variable) environment.push_back(*variable);
  environment.push_back(nullptr);

  const Pipe out = make_pipe();
  const Pipe err = make_pipe();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out.write, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.write, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  const int error = posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environment.data());
  posix_spawn_file_actions_destroy(&actions);
  ::close(out.write);
  ::close(err.write);
  out_.fd = out.read;
  err_.fd = err.read;
  if (error != 0) {
    ::close(out_.fd);
    ::close(err_.fd);
    fail(error, "cannot start " + program.string());
  }
}

Process::~Process() {
  if (!exit_code_) {
    ::kill(pid_, SIGKILL);
    while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  for (const Stream* stream : {&out_, &err_}) {
    if (stream->fd >= 0) ::close(stream->fd);
  }
}

std::string Process::wait_for_line(std::string_view text, std::chrono::nanoseconds patience) {
  const Deadline deadline = std::chrono::steady_clock::now() + patience;
  const std::string awaited = "a line with \"" + std::string(text) + "\"";
  for (;;) {
    if (auto line = next_line(out_, text)) return std::move(*line);
    if (auto line = next_line(err_, text)) return std::move(*line);
    if (ended()) give_up("has ended without " + awaited);
    listen(deadline, awaited);
  }
}

std::optional<std::string> Process::next_line(Stream& stream, std::string_view text) {
  for (std::size_t begin = stream.next;;) {
    const std::size_t end = stream.text.find('\n', begin);
    if (end == std::string::npos) return std::nullopt;
    const std::string_view line = std::string_view(stream.text).substr(begin, end - begin);
    begin = end + 1;
    if (line.find(text) == std::string_view::npos) continue;
    stream.next = begin;
    return std::string(line);
  }
}

void Process::signal(int number) {
  if (!exit_code_) ::kill(pid_, number);
}

int Process::wait(std::chrono::nanoseconds patience) {
  const Deadline deadline = std::chrono::steady_clock::now() + patience;
  while (!ended()) listen(deadline, "its end");
  if (!exit_code_) {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0) {
      if (errno != EINTR) fail(errno, "waitpid");
    }
    exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  return *exit_code_;
}

void Process::listen(Deadline deadline, const std::string& awaited) {
  using std::chrono::milliseconds;
  const auto left = std::chrono::ceil<milliseconds>(deadline - std::chrono::steady_clock::now());
  if (left <= milliseconds::zero()) give_up("was waited for in vain: " + awaited);
  // poll() ignores an entry with a negative descriptor.
  std::array<pollfd, 2> fds = {pollfd{out_.fd, POLLIN, 0}, pollfd{err_.fd, POLLIN, 0}};
  if (::poll(fds.data(), fds.size(), static_cast<int>(left.count())) < 0 && errno != EINTR) fail(errno, "poll");
  if (fds[0].revents != 0) read_some(out_);
  if (fds[1].revents != 0) read_some(err_);
}

void Process::read_some(Stream& stream) {
  std::array<char, 65536> buffer;
  const ssize_t size = ::read(stream.fd, buffer.data(), buffer.size());
  if (size > 0) {
    stream.text.append(buffer.data(), static_cast<std::size_t>(size));
  } else if (size == 0 || errno != EINTR) {
    ::close(stream.fd);
    stream.fd = -1;
  }
}

void Process::give_up(const std::string& why) const {
  throw std::runtime_error(name_ + " " + why + "\n--- its stdout:\n" + end_of(out_.text) + "\n--- its stderr:\n" +
                           end_of(err_.text));
}

}  // namespace tendon::e2e
