// SPDX-License-Identifier: Apache-2.0
#include "server/machine/unix_socket.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/machine/udp_link.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"
#include "tests/support/wire.h"

namespace tendon::unix_socket_test {
namespace {

sockaddr_un name_of(const std::filesystem::path& file) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  std::copy_n(file.c_str(), file.native().size(), name.sun_path);
  return name;
}

class Peer {
 public:
  explicit Peer(const std::filesystem::path& file, bool named = true) : fd_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
    const sockaddr unnamed{.sa_family = AF_UNIX, .sa_data = {}};
    if (named) ::bind(fd_, &unnamed, sizeof unnamed.sa_family);
    const sockaddr_un name = name_of(file);
    refused_ = ::connect(fd_, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0 ? 0 : errno;
  }
  ~Peer() { ::close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  int refused() const { return refused_; }
  void send(const std::vector<std::byte>& datagram) { ::send(fd_, datagram.data(), datagram.size(), 0); }
  std::vector<std::byte> receive() {
    std::vector<std::byte> buffer(kMaxDatagram);
    buffer.resize(static_cast<std::size_t>(std::max<ssize_t>(::recv(fd_, buffer.data(), buffer.size(), 0), 0)));
    return buffer;
  }

 private:
  int fd_;
  int refused_ = 0;
};

std::string complaint_about(const std::filesystem::path& file) {
  return thrown_by<std::runtime_error>([&] { const UnixSocket socket(file); });
}

class UnixSocketTest : public ::testing::Test {
 protected:
  const testing::ScratchFolder folder;
  const std::filesystem::path file = folder.path() / "s";
};

TEST_F(UnixSocketTest, BringsDatagramsThereAndBackByTheirSender) {
  UnixSocket server(file);
  Peer a(file);
  Peer z(file);
  a.send(bytes(3, 1));
  z.send(bytes(kMaxDatagram, 2));
  std::vector<std::byte> buffer(kMaxDatagram);
  std::optional<Duration> stamp;
  Address from_a;
  ASSERT_EQ(server.receive(from_a, buffer, stamp), 3U);
  EXPECT_TRUE(UnixSocket::is_peer(from_a)) << to_string(from_a);
  EXPECT_TRUE(is_loopback(from_a));
  EXPECT_EQ(parse_address(to_string(from_a)), from_a);
  Address from_z;
  ASSERT_EQ(server.receive(from_z, buffer, stamp), kMaxDatagram);
  EXPECT_NE(from_z, from_a);
  EXPECT_EQ(server.receive(from_z, buffer, stamp), 0U);
  EXPECT_TRUE(server.send(from_z, bytes(7, 3)));
  EXPECT_TRUE(server.send(from_a, bytes(5, 4)));
  EXPECT_EQ(a.receive(), bytes(5, 4));
  EXPECT_EQ(z.receive(), bytes(7, 3));
}

TEST_F(UnixSocketTest, SkipsWhoHasNoNameAndWhatIsEmpty) {
  UnixSocket server(file);
  Peer nameless(file, false);
  Peer named(file);
  nameless.send(bytes(3, 1));
  named.send({});
  named.send(bytes(5000, 2));
  std::vector<std::byte> buffer(kMaxDatagram);
  Address from;
  std::optional<Duration> stamp;
  EXPECT_EQ(server.receive(from, buffer, stamp), 5000U) << "cut, and the full size is told";
}

TEST_F(UnixSocketTest, LosesADatagramToAPeerThatHasGone) {
  UdpLink link(parse_address("127.0.0.1:0"), Reach::kThisMachine, file);
  auto peer = std::make_unique<Peer>(file);
  peer->send(bytes(3, 1));
  link.wait(std::chrono::seconds(10));
  std::vector<std::byte> buffer(kMaxDatagram);
  Address from;
  ASSERT_EQ(link.receive(from, buffer), 3U);
  peer.reset();
  link.send(from, bytes(3, 1));
  EXPECT_EQ(link.send_failures(), 1U);
}

TEST_F(UnixSocketTest, ALinkTakesFromBothSocketsInTurns) {
  UdpLink link(parse_address("127.0.0.1:0"), Reach::kThisMachine, file);
  UdpLink far(parse_address("127.0.0.1:0"));
  Peer near(file);
  for (int i = 0; i < 3; ++i) {
    near.send(bytes(3, 1));
    far.send(link.local_address(), bytes(4, 1));
  }
  std::vector<std::byte> buffer(kMaxDatagram);
  std::vector<bool> through_the_file;
  Address from;
  while (link.receive(from, buffer) != 0) through_the_file.push_back(UnixSocket::is_peer(from));
  EXPECT_EQ(through_the_file, (std::vector<bool>{true, false, true, false, true, false}));
  link.wait(std::chrono::milliseconds(1));
}

TEST_F(UnixSocketTest, ReplacesTheFileThatADeadServerHasLeft) {
  const int dead = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  const sockaddr_un name = name_of(file);
  ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  ::close(dead);
  ASSERT_TRUE(std::filesystem::exists(file));
  const UnixSocket server(file);
  EXPECT_EQ(Peer(file).refused(), 0);
}

TEST_F(UnixSocketTest, RefusesAFileBehindWhichAServerListens) {
  const UnixSocket first(file);
  EXPECT_EQ(complaint_about(file),
            "cannot listen on unix:" + file.string() + ": another server is already listening there");
  EXPECT_EQ(Peer(file).refused(), 0) << "the first one still does";
}

TEST_F(UnixSocketTest, LeavesAFileThatIsNoSocketAsItIs) {
  const auto notes = folder.path() / "notes";
  std::ofstream(notes) << "mine";
  EXPECT_EQ(complaint_about(notes),
            "cannot listen on unix:" + notes.string() + ": the file exists and is not a socket; it was not changed");
  std::string text;
  std::ifstream(notes) >> text;
  EXPECT_EQ(text, "mine");
  const auto link = folder.path() / "link";
  std::filesystem::create_symlink(folder.path() / "nowhere", link);
  EXPECT_NE(complaint_about(link).find("not a socket"), std::string::npos);
}

TEST_F(UnixSocketTest, SaysWhatIsWrongWithAPath) {
  const std::string longest = (folder.path() / std::string(107 - folder.path().native().size() - 1, 'x')).string();
  EXPECT_EQ(complaint_about(longest), "");
  EXPECT_EQ(complaint_about(longest + "x"),
            "cannot listen on unix:" + longest + "x: expected a path of 1 to 107 bytes, found 108");
  const auto nowhere = folder.path() / "no" / "s";
  EXPECT_EQ(complaint_about(nowhere), "cannot listen on unix:" + nowhere.string() + ": No such file or directory");
}

TEST_F(UnixSocketTest, TakesItsFileAwayAndNotThatOfAnother) {
  { const UnixSocket server(file); }
  EXPECT_FALSE(std::filesystem::exists(file));
  {
    const UnixSocket server(file);
    std::filesystem::remove(file);
    std::ofstream(file) << "mine";
  }
  EXPECT_TRUE(std::filesystem::exists(file));
}

TEST_F(UnixSocketTest, LetsInItsUserAndGroupOnly) {
  const UnixSocket server(file);
  struct stat found {};
  ASSERT_EQ(::stat(file.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 07777U, 0660U);
  if (::geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  std::filesystem::permissions(folder.path(), std::filesystem::perms(0755));
  const pid_t stranger = ::fork();
  if (stranger == 0) {
    const bool other = ::setgid(65534) == 0 && ::setuid(65534) == 0;
    ::_exit(other && Peer(file).refused() == EACCES ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(::waitpid(stranger, &status, 0), stranger);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace tendon::unix_socket_test
