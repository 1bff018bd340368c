// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/udp_transport.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <iterator>
#include <string>
#include <vector>

#include "clients/cpp/machine.h"
#include "tests/support/traffic_class_reader.h"

namespace tendon::udp_transport_test {
namespace {

/// A datagram to loopback has arrived when send() returns.
class Z {
 public:
  Z() : fd_(::socket(AF_INET, SOCK_DGRAM, 0)) {
    sockaddr_in self = loopback(0);
    EXPECT_EQ(::bind(fd_, as_sockaddr(self), sizeof self), 0);
    socklen_t size = sizeof self;
    EXPECT_EQ(::getsockname(fd_, as_sockaddr(self), &size), 0);
    port_ = ntohs(self.sin_port);
  }
  ~Z() { close(); }
  Z(const Z&) = delete;
  Z& operator=(const Z&) = delete;

  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  Address address() const { return parse_address("127.0.0.1:" + std::to_string(port_)); }
  ssize_t receive() {
    std::array<char, kMaxDatagram> buffer{};
    socklen_t size = sizeof client_;
    return ::recvfrom(fd_, buffer.data(), buffer.size(), MSG_DONTWAIT, as_sockaddr(client_), &size);
  }
  void reply(std::size_t size) {
    const std::vector<char> bytes(size, 'z');
    ::sendto(fd_, bytes.data(), bytes.size(), 0, as_sockaddr(client_), sizeof client_);
  }
  const sockaddr_in& client() const { return client_; }

 private:
  static sockaddr_in loopback(std::uint16_t port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(port);
    return address;
  }
  static sockaddr* as_sockaddr(sockaddr_in& address) { return reinterpret_cast<sockaddr*>(&address); }

  int fd_;
  std::uint16_t port_ = 0;
  sockaddr_in client_{};
};

constexpr std::array<std::byte, 8> kWords{};

void greet(UdpTransport& a, Z& z) {
  a.send(z.address(), kWords);
  EXPECT_EQ(z.receive(), 8);
}

std::size_t received(UdpTransport& a) {
  std::array<std::byte, kMaxDatagram> buffer{};
  Address from;
  return a.receive(from, buffer);
}

std::ptrdiff_t open_files() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
}

// An epoll instance that watched the socket would cost an additional wake-up for each datagram.
TEST(UdpTransport, HasASocketAndNoOtherFile) {
  Z z;
  const std::ptrdiff_t before = open_files();
  {
    const UdpTransport transport(z.address());
    EXPECT_EQ(open_files(), before + 1);
  }
  EXPECT_EQ(open_files(), before);
}

TEST(UdpTransport, TalksWithItsServer) {
  Z z;
  UdpTransport a(z.address());
  greet(a, z);
  z.reply(20);
  a.wait(std::chrono::seconds(10));
  std::array<std::byte, kMaxDatagram> buffer{};
  Address from;
  EXPECT_EQ(a.receive(from, buffer), 20U);
  EXPECT_EQ(from, z.address());
  EXPECT_EQ(a.receive(from, buffer), 0U) << "none left, and no waiting";
}

TEST(UdpTransport, WhatItHasReceivedWasHereByNowAndNotBeforeTheTurn) {
  const UdpTransport link(parse_address("127.0.0.1:9"));
  const LocalTime long_ago{};
  EXPECT_GT(link.present(long_ago), long_ago);
  EXPECT_EQ(link.present(LocalTime::max()), LocalTime::max());
}

TEST(UdpTransport, KnowsWhenADatagramHasReachedTheMachineEvenIfItIsReadLate) {
  Z z;
  UdpTransport a(z.address());
  greet(a, z);
  a.wait({});
  for (int i = 0; i < 10; ++i) {
    const LocalTime before = read_clock();
    z.reply(2);
    const LocalTime sent = read_clock();
    ::usleep(20'000);
    ASSERT_EQ(received(a), 2U);
    const LocalTime read = a.arrived(before);
    EXPECT_GE(read, sent + std::chrono::milliseconds(20));
    EXPECT_GE(a.reached(read), before);
    if (a.reached(read) == read) continue;  // first datagram, or the thread was interrupted
    EXPECT_LE(a.reached(read), sent + KernelStamps::kSteady);
    return;
  }
  ADD_FAILURE() << "none of them had a time stamp";
}

TEST(UdpTransport, MarksEachDatagramOfBothFamiliesIfItIsTold) {
  for (const int family : {AF_INET, AF_INET6}) {
    TrafficClassReader reader(family);
    UdpTransport marked(reader.text(), false, Dscp::kExpedited);
    marked.send(reader.address(), kWords);
    EXPECT_EQ(reader.next(), TrafficClassReader::kExpedited);
    marked.look_up_again(true);
    marked.send(reader.address(), kWords);
    EXPECT_EQ(reader.next(), TrafficClassReader::kExpedited);
    UdpTransport plain(reader.text());
    plain.send(reader.address(), kWords);
    EXPECT_EQ(reader.next(), 0);
  }
}

TEST(UdpTransport, TellsTheFullSizeOfADatagramItHadToCut) {
  Z z;
  UdpTransport a(z.address());
  greet(a, z);
  z.reply(5000);
  EXPECT_EQ(received(a), 5000U);
}

TEST(UdpTransport, SkipsEmptyDatagrams) {
  Z z;
  UdpTransport a(z.address());
  greet(a, z);
  z.reply(0);
  z.reply(7);
  EXPECT_EQ(received(a), 7U);
}

TEST(UdpTransport, AServerThatIsNotThereIsSilenceNotAnError) {
  Z z;
  const Address address = z.address();
  z.close();
  UdpTransport a(address);
  for (int i = 0; i < 3; ++i) {
    a.send(address, kWords);
    EXPECT_EQ(received(a), 0U);
  }
}

TEST(UdpTransport, StaysWithItsAddressAndPortWhileTheNameHasIt) {
  Z z;
  UdpTransport a(z.address());
  greet(a, z);
  const auto port = z.client().sin_port;
  a.look_up_again(false);
  a.look_up_again(true);
  EXPECT_EQ(a.server(), z.address());
  greet(a, z);
  EXPECT_EQ(z.client().sin_port, port);
}

TEST(UdpTransport, WaitsForAnyOfSeveral) {
  Z near, far;
  UdpTransport to_near(near.address()), to_far(far.address());
  greet(to_near, near);
  greet(to_far, far);
  far.reply(3);
  const std::array<UdpTransport*, 2> both{&to_near, &to_far};
  UdpTransport::wait_for_any(both, std::chrono::hours(1));  // must return immediately
  EXPECT_EQ(received(to_near), 0U);
  EXPECT_EQ(received(to_far), 3U);
  UdpTransport::wait_for_any(both, Duration::zero());
}

TEST(UdpTransport, HearsNobodyButItsServer) {
  Z z;
  Z stranger;
  UdpTransport a(z.address());
  greet(a, z);
  UdpTransport b(stranger.address());
  greet(b, stranger);
  const_cast<sockaddr_in&>(stranger.client()) = z.client();
  stranger.reply(20);
  EXPECT_EQ(received(a), 0U);
}

}  // namespace
}  // namespace tendon::udp_transport_test
