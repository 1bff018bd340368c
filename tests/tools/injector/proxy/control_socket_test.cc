// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/control_socket.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <fstream>
#include <future>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

namespace tendon::injector::control_socket_test {
namespace {

using testing::ScratchFolder;

/// Serves a socket in a thread for its lifetime. Answers with the line in brackets.
class Answering {
 public:
  explicit Answering(ControlSocket& socket)
      : thread_([this, &socket] {
          while (!stop_) {
            std::vector<pollfd> fds;
            socket.wait_for(fds);
            ::poll(fds.data(), fds.size(), 10);
            socket.turn([](std::string_view line) { return "[" + std::string(line) + "]"; });
          }
        }) {}
  ~Answering() {
    stop_ = true;
    thread_.join();
  }

 private:
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

TEST(ControlSocket, AnswersEachLineWithOneLine) {
  const ScratchFolder folder;
  const auto path = folder.path() / "control";
  ControlSocket socket(path);
  const Answering answering(socket);
  EXPECT_EQ(ask_control_socket(path, "stats"), "[stats]");
  EXPECT_EQ(ask_control_socket(path, "both delay=20ms loss=2%"), "[both delay=20ms loss=2%]");
  const std::string line(100'000, 'x');
  EXPECT_EQ(ask_control_socket(path, line), "[" + line + "]");
}

TEST(ControlSocket, IsForItsUserOnlyAndGoneAfterwards) {
  const ScratchFolder folder;
  const auto path = folder.path() / "control";
  {
    const ControlSocket socket(path);
    struct stat status {};
    ASSERT_EQ(::stat(path.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777U, 0600U);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_THROW(ask_control_socket(path, "stats"), std::runtime_error);
}

std::string refusal(const std::filesystem::path& path) {
  return thrown_by<std::runtime_error>([&] { const ControlSocket socket(path); });
}

TEST(ControlSocket, ReplacesASocketOfTheDeadAndNothingElse) {
  const ScratchFolder folder;
  const auto path = folder.path() / "control";
  {
    const ControlSocket alive(path);
    EXPECT_EQ(refusal(path), "--control " + path.string() + ": another process already listens at this socket");
  }
  const auto file = folder.path() / "file";
  std::ofstream(file) << "precious";
  EXPECT_EQ(refusal(file), "--control " + file.string() + ": the file exists and is not a socket");
  EXPECT_TRUE(std::filesystem::exists(file));
  EXPECT_NE(refusal(folder.path() / "none" / "control"), "");
  EXPECT_NE(refusal(folder.path() / std::string(200, 'x')), "");
}

}  // namespace
}  // namespace tendon::injector::control_socket_test
