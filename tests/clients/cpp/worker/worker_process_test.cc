// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/worker/worker_process.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <string>

namespace tendon::worker::worker_process_test {
namespace {

const std::string kSecret(kSecretDigits, '5');
constexpr int kPatienceMs = 30'000;

std::string fake(const std::string& arguments) { return TENDON_FAKE_WORKER " " + arguments; }

std::optional<WorkerProcess::Event> next(WorkerProcess& process, int patience_ms = kPatienceMs) {
  for (int waited = 0;;) {
    if (auto event = process.next()) return event;
    if (waited >= patience_ms) return std::nullopt;
    pollfd readable{.fd = process.descriptor(), .events = POLLIN, .revents = 0};
    waited += ::poll(&readable, 1, 100) == 0 ? 100 : 0;
  }
}

bool opened(WorkerProcess& process) {
  const auto event = next(process);
  return event && std::holds_alternative<WorkerProcess::Opened>(*event);
}

std::string ended(WorkerProcess& process) {
  const auto event = next(process);
  const auto* end = event ? std::get_if<WorkerProcess::Ended>(&*event) : nullptr;
  return end != nullptr ? end->why : "it has not ended";
}

/// Returns the number of processes whose command line contains `text`. Zombies are not included.
int running(const std::string& text) {
  int count = 0;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
    std::ifstream file(entry.path() / "cmdline", std::ios::binary);
    const std::string line{std::istreambuf_iterator<char>(file), {}};
    count += line.find(text) != std::string::npos ? 1 : 0;
  }
  return count;
}

bool gone(WorkerProcess& process, const std::string& text) {
  for (int i = 0; i < kPatienceMs / 10; ++i) {
    process.next();
    if (running(text) == 0) return true;
    ::usleep(10'000);
  }
  return false;
}

class WorkerProcessTest : public ::testing::TestWithParam<const char*> {
 protected:
  static WorkerProcess::Config config(const std::string& arguments) {
    return {.command = fake(arguments), .listen = GetParam()};
  }
};

TEST_P(WorkerProcessTest, AWorkerOpensAndAnswers) {
  WorkerProcess process(config("well"));
  process.launch(kSecret);
  ASSERT_TRUE(opened(process));
  Codec codec;
  for (std::uint64_t i = 1; i <= 100; ++i) {
    DeviceState hand;
    hand.tick = i;
    hand.position = Vec3(0.001 * static_cast<double>(i), 0, 0);
    process.send(codec.state(i, hand));
    const auto event = next(process);
    ASSERT_TRUE(event && std::holds_alternative<Record>(*event));
    const auto answer = codec.read_answer(std::get<Record>(*event), i, hand);
    ASSERT_TRUE(answer.touch.has_value()) << answer.refused;
    EXPECT_DOUBLE_EQ(answer.touch->force.x(), -0.2 * static_cast<double>(i));
  }
}

TEST_P(WorkerProcessTest, WhatEndsAWorkerIsSaid) {
  struct Case {
    const char* way;
    const char* why;
  };
  for (const Case& one : {Case{"dies 0", "it was terminated by signal 9"}, Case{"exits 0", "it exited with status 7"},
                          Case{"ends-at-once", "it exited with status 3"}}) {
    WorkerProcess process(config(one.way));
    process.launch(kSecret);
    if (std::string(one.way) != "ends-at-once") {
      ASSERT_TRUE(opened(process)) << one.way;
      Codec codec;
      process.send(codec.state(1, DeviceState{}));
    }
    const std::string why = ended(process);
    EXPECT_TRUE(why == one.why || why == "it has closed the connection") << one.way << ": " << why;
    EXPECT_FALSE(next(process, 100).has_value()) << "once";
  }
}

INSTANTIATE_TEST_SUITE_P(Streams, WorkerProcessTest, ::testing::Values("", "127.0.0.1:0"),
                         [](const auto& stream) { return stream.param[0] == '\0' ? "Unix" : "Tcp"; });

TEST(WorkerProcess, ACommandThatIsNotThereIsSaid) {
  WorkerProcess process({.command = "/nonexistent/tendon-fem-worker scene.toml"});
  process.launch(kSecret);
  EXPECT_EQ(ended(process), "it exited with status 127");
}

TEST(WorkerProcess, EndsEvenWhatHasLeftItsProcessGroupAndWhatIsStopped) {
  const std::string mark = "with-a-child 987123";
  WorkerProcess process({.command = fake(mark)});
  process.launch(kSecret);
  ASSERT_TRUE(opened(process));
  ASSERT_EQ(running("987123"), 2);
  process.kill();
  EXPECT_TRUE(gone(process, "987123"));

  WorkerProcess::Config stops{.command = fake("stops 0 987124")};
  WorkerProcess other(stops);
  other.launch(kSecret);
  ASSERT_TRUE(opened(other));
  Codec codec;
  other.send(codec.state(1, DeviceState{}));
  EXPECT_FALSE(next(other, 300).has_value());
  ASSERT_EQ(running("987124"), 1);
  other.kill();
  EXPECT_TRUE(gone(other, "987124"));
}

TEST(WorkerProcess, TheNextWorkerIsLeftAloneWhileTheLastOneIsEnded) {
  WorkerProcess process({.command = fake("with-a-child 987125")});
  for (int i = 0; i < 5; ++i) {
    process.launch(kSecret);
    ASSERT_TRUE(opened(process)) << i;
    EXPECT_FALSE(next(process, 50).has_value()) << "it goes on";
  }
  process.kill();
  EXPECT_TRUE(gone(process, "987125"));
}

int connect_to(const std::string& address) {
  const std::string path = address.substr(5);
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  std::strncpy(to.sun_path, path.c_str(), sizeof to.sun_path - 1);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  EXPECT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
  return socket;
}

TEST(WorkerProcess, AConnectionWithoutTheSecretDoesNotOpenTheStream) {
  WorkerProcess process({.command = fake("never-opens")});
  process.launch(kSecret);
  const int silent = connect_to(process.address());
  const int wrong = connect_to(process.address());
  const auto guess = to_bytes(opening(std::string(kSecretDigits, '6')));
  ASSERT_EQ(::write(wrong, guess.data(), guess.size()), static_cast<ssize_t>(guess.size()));
  EXPECT_FALSE(next(process, 300).has_value());
  const int right = connect_to(process.address());
  const auto word = to_bytes(opening(kSecret));
  ASSERT_EQ(::write(right, word.data(), word.size()), static_cast<ssize_t>(word.size()));
  EXPECT_TRUE(opened(process));
  const int late = connect_to(process.address());
  ASSERT_EQ(::write(late, word.data(), word.size()), static_cast<ssize_t>(word.size()));
  EXPECT_FALSE(next(process, 300).has_value());
  for (const int socket : {silent, wrong, right, late}) ::close(socket);
}

TEST(WorkerProcess, DoesNotListenWhereNoWorkerCouldFindIt) {
  for (const char* any : {"0.0.0.0:0", "[::]:0"}) {
    EXPECT_THROW(WorkerProcess({.command = "true", .listen = any}), std::runtime_error) << any;
  }
}

TEST(WorkerProcess, TheSocketIsInAFolderOfThisUserAlone) {
  std::string path;
  {
    const WorkerProcess process({.command = "true"});
    path = process.address().substr(5);
    struct stat status {};
    ASSERT_EQ(::stat(std::filesystem::path(path).parent_path().c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777U, 0700U);
  }
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace tendon::worker::worker_process_test
