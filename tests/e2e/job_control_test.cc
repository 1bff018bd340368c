// SPDX-License-Identifier: Apache-2.0
// Runs the server as a job of an interactive shell: Ctrl-Z, bg, fg, and `stty tostop`.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>

#include "tests/e2e/stage/stage.h"
#include "tests/e2e/stage/threads.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::job_control_test {
namespace {

class Shell {
 public:
  explicit Shell(const std::filesystem::path& folder) {
    pid_ = ::forkpty(&terminal_, nullptr, nullptr, nullptr);
    if (pid_ < 0) throw std::runtime_error("no terminal");
    if (pid_ == 0) {
      if (::chdir(folder.c_str()) == 0)
        ::execl("/bin/bash", "bash", "--norc", "--noprofile", "--noediting", "-i", nullptr);
      std::_Exit(127);
    }
  }
  ~Shell() {
    if (job_ > 0) ::kill(job_, SIGKILL);
    ::kill(pid_, SIGKILL);
    ::close(terminal_);
    ::waitpid(pid_, nullptr, 0);
  }
  Shell(const Shell&) = delete;
  Shell& operator=(const Shell&) = delete;

  void type(std::string_view keys) const {
    if (::write(terminal_, keys.data(), keys.size()) != static_cast<ssize_t>(keys.size())) {
      throw std::runtime_error("the terminal takes no keys");
    }
  }

  /// Waits for `text` and returns the output before it. The next call starts after `text`.
  std::string wait_for(std::string_view text) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    std::array<char, 4096> part{};
    for (;;) {
      if (const std::size_t found = seen_.find(text, next_); found != std::string::npos) {
        const std::string before = seen_.substr(next_, found - next_);
        next_ = found + text.size();
        return before;
      }
      pollfd ready{terminal_, POLLIN, 0};
      ::poll(&ready, 1, 100);
      const ssize_t size = ready.revents == 0 ? 0 : ::read(terminal_, part.data(), part.size());
      if (size < 0 || std::chrono::steady_clock::now() > end) {
        throw std::runtime_error("waited in vain for: " + std::string(text) + "\n--- the terminal:\n" + seen_);
      }
      seen_.append(part.data(), static_cast<std::size_t>(size));
    }
  }

  pid_t start(const std::string& command) {
    type(command + " & echo started=$!.\n");
    wait_for("$!.");
    wait_for("started=");
    job_ = std::stoi(wait_for("."));
    return job_;
  }

 private:
  int terminal_ = -1;
  pid_t pid_ = -1;
  pid_t job_ = 0;
  std::string seen_;
  std::size_t next_ = 0;
};

TEST(JobControl, InATerminalWithTostopTheServerServesAndStopsOnlyAtCtrlZ) {
  const testing::ScratchFolder folder;
  const std::string scene = write(folder.path() / "scene.toml", kPressingHand);
  Shell shell(folder.path());
  shell.type("stty tostop\n");
  const pid_t server =
      shell.start(program("tendond").string() + " " + scene + " --listen 127.0.0.1:0 --duration-s 100");
  shell.wait_for("listens on ");
  std::string address = shell.wait_for("\r\n");
  for (int run = 0; run < 2; ++run) {
    Process wall(program("virtual_wall"), {"--server", address, "--duration-s", "0.5"}, folder.path());
    EXPECT_EQ(wall.wait(), 0);
    shell.wait_for("welcomed controller");
    EXPECT_NE(state_of(server), 'T') << "it has written to the terminal, in the background";
    shell.type("fg\n");
    shell.wait_for("tendond ");
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    shell.type("\x1a");
    shell.wait_for("stopped by SIGTSTP: the force is zero");
    shell.wait_for("Stopped");
    EXPECT_EQ(state_of(server), 'T');
    shell.type("bg\n");
    shell.wait_for("continued after SIGCONT");
  }
  ::kill(server, SIGTERM);
  shell.wait_for("stopped: signal 15");
}

}  // namespace
}  // namespace tendon::e2e::job_control_test
