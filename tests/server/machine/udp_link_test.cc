// SPDX-License-Identifier: Apache-2.0
#include "server/machine/udp_link.h"

#include <gtest/gtest.h>
#include <poll.h>

#include <cerrno>
#include <filesystem>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "protocol/wire/header.h"
#include "server/machine/clock.h"
#include "tests/support/refusal.h"
#include "tests/support/traffic_class_reader.h"
#include "tests/support/wire.h"

namespace tendon::udp_link_test {
namespace {

using namespace std::chrono_literals;

/// This timeout is only reached if a test fails.
constexpr Duration kForever = 10s;

constexpr Address kAnyPort4 = {.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 127, 0, 0, 1}, .port = 0};
constexpr Address kAnyPort6 = {.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, .port = 0};

template <typename Error>
std::string complaint_about(const Address& listen) {
  return thrown_by<Error>([&] { const UdpLink link(listen); });
}

bool is_readable(int fd) {
  pollfd entry{fd, POLLIN, 0};
  return ::poll(&entry, 1, 0) == 1;
}

/// Returns the number of open files of this process, including the one that reads the folder.
std::ptrdiff_t open_files() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
}

class UdpLinkTest : public ::testing::TestWithParam<Address> {
 protected:
  UdpLink a{GetParam()};
  UdpLink z{GetParam()};
  Bytes buffer = Bytes(kMaxDatagram);
  Address from;
};

// An epoll instance on the socket would cost a useless wake-up per datagram.
TEST_P(UdpLinkTest, HasASocketAndNoOtherFile) {
  const std::ptrdiff_t before = open_files();
  {
    const UdpLink link(GetParam());
    EXPECT_EQ(open_files(), before + 1);
    EXPECT_THROW(UdpLink(link.local_address()), std::runtime_error);
    EXPECT_EQ(open_files(), before + 1);
  }
  EXPECT_EQ(open_files(), before);
}

TEST_P(UdpLinkTest, BringsDatagramsFromAToZInOrderWithTheirSender) {
  a.send(z.local_address(), bytes(3, 1));
  a.send(z.local_address(), bytes(kMaxDatagram, 2));
  for (const auto& sent : {bytes(3, 1), bytes(kMaxDatagram, 2)}) {
    z.wait(kForever);
    ASSERT_EQ(z.receive(from, buffer), sent.size());
    EXPECT_TRUE(std::equal(sent.begin(), sent.end(), buffer.begin()));
    EXPECT_EQ(from, a.local_address());
  }
  EXPECT_EQ(z.receive(from, buffer), 0U);
  EXPECT_EQ(a.send_failures(), 0U);
}

TEST_P(UdpLinkTest, TellsTheFullSizeOfADatagramThatWasCut) {
  a.send(z.local_address(), bytes(5000, 1));
  buffer.assign(kMaxDatagram + 1, std::byte{0xee});
  z.wait(kForever);
  EXPECT_EQ(z.receive(from, std::span(buffer).first(kMaxDatagram)), 5000U);
  EXPECT_EQ(buffer.back(), std::byte{0xee});
  EXPECT_EQ(z.receive(from, buffer), 0U) << "the rest must be gone";
}

TEST_P(UdpLinkTest, SkipsEmptyDatagramsToReachTheOneBehindThem) {
  for (int i = 0; i < 10; ++i) a.send(z.local_address(), {});
  a.send(z.local_address(), bytes(7, 1));
  z.wait(kForever);
  EXPECT_EQ(z.receive(from, buffer), 7U);
}

TEST_P(UdpLinkTest, CountsWhatItCouldNotSendAndLivesOn) {
  a.send(z.local_address(), std::vector<std::byte>(70'000));  // exceeds the maximum of UDP
  EXPECT_EQ(a.send_failures(), 1U);
  a.send(GetParam() == kAnyPort4 ? parse_address("[::1]:9") : parse_address("127.0.0.1:9"), bytes(1, 1));
  EXPECT_EQ(a.send_failures(), 2U);
  a.send(z.local_address(), bytes(1, 1));
  EXPECT_EQ(a.send_failures(), 2U);
  z.wait(kForever);
  EXPECT_EQ(z.receive(from, buffer), 1U);
}

TEST_P(UdpLinkTest, APortInUseIsRefusedByNameAndReason) {
  const UdpLink first(GetParam());
  const Address taken = first.local_address();
  EXPECT_EQ(complaint_about<std::runtime_error>(taken),
            "cannot listen on " + to_string(taken) +
                ": Address already in use; use `ss -lunp` to find the program that uses it");
}

/// Sends a datagram from `client` to `asked_at` and returns the source address of the answer.
Address answered_from(UdpLink& client, const Address& asked_at, UdpLink& hears, UdpLink& answers) {
  client.send(asked_at, bytes(5, 1));
  Bytes buffer(kMaxDatagram);
  Address from;
  hears.wait(kForever);
  if (hears.receive(from, buffer) != 5) return {};
  EXPECT_EQ(from, client.local_address());
  answers.send(from, bytes(6, 1));
  client.wait(kForever);
  if (client.receive(from, buffer) != 6) return {};
  return from;
}

// A client with a connected socket drops answers from other addresses.
TEST(UdpLink, OnAllAddressesItAnswersFromTheOneThatWasAsked) {
  for (const char* all : {"0.0.0.0:0", "[::]:0"}) {
    UdpLink link(parse_address(all), Reach::kAnywhere);
    const std::string port = ":" + std::to_string(link.local_address().port);
    for (const char* const own : {"127.0.0.1:0", "127.0.0.9:0"}) {
      UdpLink client(parse_address(own));
      for (const char* const host : {"127.0.0.1", "127.0.0.2", "127.0.0.3", "127.0.0.2"}) {
        const Address asked = parse_address(host + port);
        EXPECT_EQ(to_string(answered_from(client, asked, link, link)), to_string(asked)) << all << ' ' << own;
      }
    }
    EXPECT_EQ(link.send_failures(), 0U);
  }
}

TEST(UdpLink, OnAllAddressesOfIpv6ItHearsBothFamilies) {
  UdpLink link(parse_address("[::]:0"), Reach::kAnywhere);
  const std::string port = ":" + std::to_string(link.local_address().port);
  UdpLink six(kAnyPort6);
  UdpLink four(kAnyPort4);
  EXPECT_EQ(to_string(answered_from(six, parse_address("[::1]" + port), link, link)), "[::1]" + port);
  EXPECT_EQ(to_string(answered_from(four, parse_address("127.0.0.2" + port), link, link)), "127.0.0.2" + port);
}

// The answer can be sent by another link than the first one, which receives each Hello.
TEST(UdpLink, SeveralOnAllAddressesKnowWhereAPeerHasAskedOneOfThem) {
  for (const char* all : {"0.0.0.0:0", "[::]:0"}) {
    const auto links = UdpLink::several(parse_address(all), Reach::kAnywhere, 2);
    const Address asked = parse_address("127.0.0.2:" + std::to_string(links[0]->local_address().port));
    UdpLink client(kAnyPort4);
    EXPECT_EQ(to_string(answered_from(client, asked, *links[0], *links[1])), to_string(asked));
  }
}

TEST(UdpLink, AnswersWhoHasLostItsPlaceAmongThousands) {
  UdpLink link(parse_address("0.0.0.0:0"), Reach::kAnywhere);
  const Address asked = parse_address("127.0.0.1:" + std::to_string(link.local_address().port));
  UdpLink first(kAnyPort4);
  EXPECT_EQ(answered_from(first, asked, link, link), asked);
  AskedAt crowd;
  Address peer = first.local_address();
  crowd.put(peer, asked.ip);
  EXPECT_EQ(crowd.find(peer), asked.ip);
  for (int i = 0; i < 100'000; ++i) {
    ++peer.port;
    peer.ip[15] = static_cast<std::uint8_t>(i >> 16);
    crowd.put(peer, kAnyPort6.ip);
    EXPECT_EQ(crowd.find(peer), kAnyPort6.ip);
  }
}

Bytes of_connection(std::uint32_t id, DatagramType type = DatagramType::kData) {
  const auto header = encode_header({.type = type, .connection_id = id});
  return {header.begin(), header.end()};
}

TEST_P(UdpLinkTest, SeveralOnOneAddressEachGetTheDataOfTheirConnections) {
  const auto links = UdpLink::several(GetParam(), Reach::kThisMachine, 4);
  ASSERT_EQ(links.size(), 4U);
  for (const auto& link : links) EXPECT_EQ(link->local_address(), links[0]->local_address());
  // Otherwise the kernel would distribute datagrams by sender.
  std::vector<std::unique_ptr<UdpLink>> clients;
  for (int i = 0; i < 8; ++i) clients.push_back(std::make_unique<UdpLink>(GetParam()));
  for (const std::uint32_t id : {4U, 5U, 6U, 7U, 0x12345602U, 0xFFFFFFFFU}) {
    for (const auto& client : clients) {
      client->send(links[0]->local_address(), of_connection(id));
      for (std::size_t place = 0; place < links.size(); ++place) {
        EXPECT_EQ(links[place]->receive(from, buffer), place == id % 4 ? kHeaderSize : 0U) << id << " at " << place;
        if (place == id % 4) {
          EXPECT_EQ(from, client->local_address());
        }
      }
    }
  }
}

TEST_P(UdpLinkTest, OfSeveralTheFirstGetsAllElse) {
  const auto links = UdpLink::several(GetParam(), Reach::kThisMachine, 2);
  const std::vector<Bytes> others = {of_connection(3, DatagramType::kHello), of_connection(1, DatagramType::kAnswer),
                                     bytes(1, 7), bytes(3, 1), Bytes(kMaxDatagram, std::byte{0xFF})};
  for (const Bytes& other : others) {
    a.send(links[0]->local_address(), other);
    EXPECT_EQ(links[1]->receive(from, buffer), 0U);
    EXPECT_EQ(links[0]->receive(from, buffer), other.size());
  }
}

TEST_P(UdpLinkTest, SeveralRefuseAnAddressOfOthersAndKeepOthersOutOfTheirs) {
  const auto links = UdpLink::several(GetParam(), Reach::kThisMachine, 2);
  const Address taken = links[0]->local_address();
  const std::string refusal = "cannot listen on " + to_string(taken) +
                              ": Address already in use; use `ss -lunp` to find the program that uses it";
  EXPECT_EQ(complaint_about<std::runtime_error>(taken), refusal);
  EXPECT_EQ(thrown_by<std::runtime_error>([&] { UdpLink::several(taken, Reach::kThisMachine, 2); }), refusal);
}

TEST_P(UdpLinkTest, OfSeveralEachAnswersFromTheirAddress) {
  const auto links = UdpLink::several(GetParam(), Reach::kThisMachine, 2);
  links[1]->send(a.local_address(), bytes(2, 1));
  a.wait(kForever);
  EXPECT_EQ(a.receive(from, buffer), 2U);
  EXPECT_EQ(from, links[0]->local_address());
}

INSTANTIATE_TEST_SUITE_P(Ipv4AndIpv6, UdpLinkTest, ::testing::Values(kAnyPort4, kAnyPort6),
                         [](const auto& test) { return test.param == kAnyPort4 ? "Ipv4" : "Ipv6"; });

/// Returns the traffic classes of the datagrams that `link` sends to a reader of each family that it can reach: the
/// first one, and then the answer to one of the reader, from the address that it has used.
std::vector<int> classes_from(UdpLink& link) {
  std::vector<int> classes;
  Bytes buffer(kMaxDatagram);
  Address from;
  const Address own = link.local_address();
  const bool any6 = !is_ipv4(own) && own.ip[15] == 0;
  for (const int family : {AF_INET, AF_INET6}) {
    if (is_ipv4(own) != (family == AF_INET) && !any6) continue;
    TrafficClassReader reader(family);
    link.send(reader.address(), bytes(3, 1));
    classes.push_back(reader.next());
    reader.send(own.port, bytes(5, 1));
    link.wait(kForever);
    EXPECT_EQ(link.receive(from, buffer), 5U);
    link.send(from, bytes(kMaxDatagram, 1));
    classes.push_back(reader.next());
  }
  return classes;
}

TEST(UdpLink, MarksEachDatagramOfBothFamiliesIfItIsTold) {
  constexpr int kEf = TrafficClassReader::kExpedited;
  for (const char* const listen : {"127.0.0.1:0", "[::1]:0", "0.0.0.0:0", "[::]:0"}) {
    const std::size_t count = std::string(listen) == "[::]:0" ? 4 : 2;
    UdpLink marked(parse_address(listen), Reach::kAnywhere, std::nullopt, Dscp::kExpedited);
    EXPECT_EQ(classes_from(marked), std::vector<int>(count, kEf)) << listen;
    UdpLink plain(parse_address(listen), Reach::kAnywhere);
    EXPECT_EQ(classes_from(plain), std::vector<int>(count, 0)) << listen;
    int priority = 0;
    socklen_t size = sizeof priority;
    EXPECT_EQ(::getsockopt(marked.fd(), SOL_SOCKET, SO_PRIORITY, &priority, &size), 0);
    EXPECT_EQ(priority, 6) << listen;
  }
}

TEST(UdpLink, SeveralMarkTheirDatagramsToo) {
  const auto links = UdpLink::several(kAnyPort6, Reach::kThisMachine, 4, Dscp::kExpedited);
  TrafficClassReader reader(AF_INET6);
  for (const auto& link : links) {
    link->send(reader.address(), bytes(3, 1));
    EXPECT_EQ(reader.next(), TrafficClassReader::kExpedited);
  }
}

TEST(UdpLink, RefusesAnAddressThatOthersCanReachAndSaysWhy) {
  for (const char* const text : {"0.0.0.0:47100", "[::]:47100", "192.168.1.20:47100"}) {
    EXPECT_EQ(
        complaint_about<std::invalid_argument>(parse_address(text)),
        "cannot listen on " + std::string(text) +
            ": without keys, anyone on the network could command forces; use a loopback address (127.0.0.1 or [::1]), "
            "or create a key for each client (`tendond keygen NAME`, and `keys` in [network] of the scene)");
  }
}

TEST(UdpLink, ListensWhereItIsToldToWhenThatIsMeant) {
  const UdpLink link(parse_address("0.0.0.0:0"), Reach::kAnywhere);
  EXPECT_NE(link.local_address().port, 0);
}

TEST(UdpLink, TheDoorbellEndsAWaitAndIsAnswered) {
  UdpLink link(kAnyPort4);
  Doorbell bell;
  bell.ring();
  bell.ring();
  link.wait(kForever, &bell);
  EXPECT_FALSE(is_readable(bell.fd()));
}

TEST(UdpLink, WhatItHasReceivedWasHereByNowAndNotBeforeTheTurn) {
  const UdpLink link(parse_address("127.0.0.1:0"));
  const LocalTime long_ago{};
  EXPECT_GT(link.present(long_ago), long_ago);
  EXPECT_EQ(link.present(LocalTime::max()), LocalTime::max());
}

TEST_P(UdpLinkTest, KnowsWhenADatagramHasReachedTheMachineEvenIfItIsReadLate) {
  constexpr Duration kLate = 20ms;
  z.wait(0s);
  for (int i = 0; i < 10; ++i) {
    const LocalTime before = z.present({});
    a.send(z.local_address(), bytes(2, 1));
    const LocalTime sent = z.present({});  // over the loopback interface, it has arrived
    clock::sleep_until(sent + kLate);
    ASSERT_EQ(z.receive(from, buffer), 2U);
    const LocalTime read = z.arrived(before);
    EXPECT_GE(read, sent + kLate);
    EXPECT_GE(z.reached(read), before);
    EXPECT_EQ(z.reached(before), before) << "not after the time that a turn believes";
    if (z.reached(read) == read) continue;  // first datagram, or the thread was interrupted
    EXPECT_LE(z.reached(read), sent + KernelStamps::kSteady);
    return;
  }
  ADD_FAILURE() << "none of them had a time stamp";
}

TEST(UdpLink, AWaitWithoutTimeLeftDoesNotWait) {
  UdpLink link(kAnyPort4);
  link.wait(0s);
  link.wait(-1h);
}

TEST(Doorbell, IsReadableFromTheFirstRingUntilItIsAnswered) {
  Doorbell bell;
  EXPECT_FALSE(is_readable(bell.fd()));
  bell.ring();
  bell.ring();
  EXPECT_TRUE(is_readable(bell.fd()));
  bell.answer();
  EXPECT_FALSE(is_readable(bell.fd()));
  bell.answer();
}

TEST(Doorbell, TellsAThreadThatDoesNotSleepThatItHasRung) {
  Doorbell bell;
  EXPECT_FALSE(bell.rung());
  bell.ring();
  bell.ring();
  EXPECT_TRUE(bell.rung());
  bell.answer();
  EXPECT_FALSE(bell.rung());
  bell.ring();
  EXPECT_TRUE(bell.rung());
}

TEST(Doorbell, KeepsErrnoForTheCodeThatASignalInterrupted) {
  Doorbell bell;
  errno = ENOENT;
  bell.ring();
  EXPECT_EQ(errno, ENOENT);
}

}  // namespace
}  // namespace tendon::udp_link_test
