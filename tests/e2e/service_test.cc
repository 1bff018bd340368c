// SPDX-License-Identifier: Apache-2.0
// The test receives the datagrams that are sent by sd_notify(3).
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::service_test {
namespace {

class Manager {
 public:
  /// `path` is the path of a file, or "@" followed by an abstract name.
  explicit Manager(const std::string& path) : socket_(socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    if (path.starts_with('@')) address.sun_path[0] = '\0';
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
    if (bind(socket_, reinterpret_cast<const sockaddr*>(&address), size) != 0) {
      throw std::runtime_error("cannot bind " + path);
    }
    const timeval patience{.tv_sec = kPatience.count(), .tv_usec = 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof(patience));
    setenv("NOTIFY_SOCKET", path.c_str(), 1);
  }
  ~Manager() {
    close(socket_);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
  }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  std::string next() const {
    std::array<char, 256> bytes{};
    const ssize_t size = recv(socket_, bytes.data(), bytes.size(), 0);
    return size > 0 ? std::string(bytes.data(), static_cast<std::size_t>(size)) : "";
  }

 private:
  int socket_;
};

TEST(Service, IsSaidToBeReadyAliveAndStopping) {
  const testing::ScratchFolder folder;
  const Manager manager((folder.path() / "notify").string());
  setenv("WATCHDOG_USEC", "100000", 1);
  Server server(folder.path(), demo_scene());
  EXPECT_EQ(manager.next(), "READY=1");
  for (int i = 0; i < 4; ++i) EXPECT_EQ(manager.next(), "WATCHDOG=1");
  server.stop();
  std::string last = manager.next();
  while (last == "WATCHDOG=1") last = manager.next();
  EXPECT_EQ(last, "STOPPING=1");
}

TEST(Service, IsSaidToAManagerWhoseSocketIsNoFile) {
  const testing::ScratchFolder folder;
  const Manager manager("@tendon-service-test-" + std::to_string(getpid()));
  Server server(folder.path(), demo_scene());
  EXPECT_EQ(manager.next(), "READY=1");
}

TEST(Service, WithoutAWatchdogNothingIsSaidBetweenTheBeginningAndTheEnd) {
  const testing::ScratchFolder folder;
  const Manager manager((folder.path() / "notify").string());
  // These variables are inherited and belong to the watchdog of another process.
  setenv("WATCHDOG_USEC", "100000", 1);
  setenv("WATCHDOG_PID", "1", 1);
  Server server(folder.path(), demo_scene());
  EXPECT_EQ(manager.next(), "READY=1");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  server.stop();
  EXPECT_EQ(manager.next(), "STOPPING=1");
}

}  // namespace
}  // namespace tendon::e2e::service_test
