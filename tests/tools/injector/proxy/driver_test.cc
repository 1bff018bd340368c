// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/driver.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector::driver_test {
namespace {

using namespace std::chrono_literals;

/// Virtual machines pause and builds run in parallel, so no test checks when datagrams leave.
constexpr int kPatienceMs = 30'000;

template <typename Condition>
bool eventually(Condition condition) {
  for (int waited_ms = 0; waited_ms < kPatienceMs; waited_ms += 10) {
    if (condition()) return true;
    ::poll(nullptr, 0, 10);
  }
  return false;
}

class Peer {
 public:
  explicit Peer(UdpBatch socket) : socket_(std::move(socket)) {}

  void send(const std::string& text, const Address& to = {}) {
    const UdpBatch::Outgoing datagram{to, std::as_bytes(std::span(text))};
    EXPECT_TRUE(socket_.send({&datagram, 1}).none());
  }
  struct Got {
    std::string text;
    Address from;
  };
  std::optional<Got> receive() {
    while (waiting_.empty()) {
      pollfd readable{socket_.fd(), POLLIN, 0};
      if (::poll(&readable, 1, kPatienceMs) <= 0) return std::nullopt;
      for (const UdpBatch::Arrival& arrival : socket_.receive(inbox_)) {
        waiting_.push_back(
            {std::string(reinterpret_cast<const char*>(arrival.datagram.data()), arrival.datagram.size()),
             arrival.from});
      }
    }
    Got got = waiting_.front();
    waiting_.erase(waiting_.begin());
    return got;
  }
  std::string text() {
    const auto got = receive();
    return got ? got->text : "nothing came";
  }
  Address address() const { return socket_.local_address(); }

 private:
  UdpBatch socket_;
  UdpBatch::Inbox inbox_;
  std::vector<Got> waiting_;
};

class Running {
 public:
  Running(const Address& server, const std::string& up, const std::string& down = "",
          const std::string& listen = "127.0.0.1:0")
      : Running(std::vector{server}, up, down, listen) {}
  Running(const std::vector<Address>& servers, const std::string& up, const std::string& down,
          const std::string& listen = "127.0.0.1:0")
      : driver_({.listen = parse_address(listen),
                 .servers = servers,
                 .proxy = {.networks = {Injector(parse_profile(up), 7, 0, Direction::kUp),
                                        Injector(parse_profile(down), 7, 0, Direction::kDown)}}},
                nullptr),
        thread_([this] { driver_.run(); }) {}
  ~Running() { stop(); }
  Status stop() {
    driver_.stop();
    if (thread_.joinable()) thread_.join();
    return driver_.status();
  }
  Driver& driver() { return driver_; }
  Peer client() { return Peer(UdpBatch::connected(driver_.local_address())); }

 private:
  Driver driver_;
  std::thread thread_;
};

Peer server(const std::string& address = "127.0.0.1:0") { return Peer(UdpBatch::listening(parse_address(address))); }

Address expect_round_trip(Peer& client, Peer& server_end, const std::string& text) {
  client.send(text);
  const auto got = server_end.receive().value_or(Peer::Got{"nothing came", {}});
  EXPECT_EQ(got.text, text);
  server_end.send(text, got.from);
  EXPECT_EQ(client.text(), text);
  return got.from;
}

TEST(Driver, CarriesDatagramsUpAndAnswersDownToTheClientTheyAreFor) {
  Peer server_end = server();
  Running proxy(server_end.address(), "delay=2ms", "delay=3ms");
  Peer a = proxy.client();
  Peer z = proxy.client();
  a.send("from a");
  const auto first = server_end.receive();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->text, "from a");
  z.send("from z");
  const auto second = server_end.receive();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->text, "from z");
  EXPECT_NE(first->from, second->from) << "the server tells its clients apart by their ports";
  server_end.send("to z", second->from);
  server_end.send("to a", first->from);
  EXPECT_EQ(a.text(), "to a");
  EXPECT_EQ(z.text(), "to z");

  const Status end = proxy.stop();
  EXPECT_EQ(end.clients.size(), 2U);
  EXPECT_EQ(end.of(Direction::kUp).counters.forwarded, 2U);
  EXPECT_EQ(end.of(Direction::kDown).counters.forwarded, 2U);
  EXPECT_GE(end.of(Direction::kUp).delay.quantile(0), 2ms) << "nothing leaves before it is due";
  EXPECT_GE(end.of(Direction::kDown).delay.quantile(0), 3ms);
}

TEST(Driver, CarriesEmptyAndLargestDatagramsAndSpeaksIpv6) {
  Peer server_end = server("[::1]:0");
  Running proxy(server_end.address(), "", "", "[::1]:0");
  Peer client = proxy.client();
  const std::string largest(65'507, 'x');
  for (const std::string& text : {std::string(), std::string("a"), largest}) {
    expect_round_trip(client, server_end, text);
  }
}

TEST(Driver, ARebindChangesThePortAndAnswersStillReachTheClient) {
  Peer server_end = server();
  Running proxy(server_end.address(), "rebind(every=1ms)");
  Peer client = proxy.client();
  std::set<Address> ports;
  // Waiting for each answer makes this loop take some milliseconds on any machine.
  for (int i = 0; i < 10'000 && ports.size() < 3 && !HasFailure(); ++i) {
    ports.insert(expect_round_trip(client, server_end, "ping"));
  }
  EXPECT_GE(ports.size(), 3U);
  EXPECT_EQ(proxy.stop().clients.size(), 1U);
}

TEST(Driver, AChangeIsInForceForWhatComesAfterIt) {
  Peer server_end = server();
  Running proxy(server_end.address(), "");
  Peer client = proxy.client();
  client.send("before");
  EXPECT_EQ(server_end.text(), "before");
  Proxy::PreparedChange change;
  change.to[0].emplace(parse_profile("loss=100%"), 7, 0, Direction::kUp);
  change.text = "up loss=100%";
  proxy.driver().change(change);
  ASSERT_TRUE(eventually([&] { return proxy.driver().status().last_change == change.text; }));
  client.send("lost");
  change.to[0].emplace(parse_profile(""), 7, 0, Direction::kUp);
  change.text = "up again";
  // The loss must be decided before the network becomes good.
  ASSERT_TRUE(eventually([&] { return proxy.driver().status().of(Direction::kUp).counters.lost() > 0; }));
  proxy.driver().change(change);
  ASSERT_TRUE(eventually([&] { return proxy.driver().status().last_change == change.text; }));
  client.send("after");
  EXPECT_EQ(server_end.text(), "after");
}

TEST(Driver, AServerThatIsNotThereYetStopsNothing) {
  Address nobody;
  { nobody = server().address(); }
  Running proxy(nobody, "");
  Peer client = proxy.client();
  for (int i = 0; i < 10; ++i) client.send("anyone?");
  ASSERT_TRUE(eventually([&] { return proxy.driver().status().of(Direction::kUp).counters.received >= 10; }));
  Peer late(UdpBatch::listening(nobody));
  client.send("now");
  EXPECT_EQ(late.text(), "now");
}

TEST(Driver, ListeningOnAllAddressesItAnswersFromTheOneThatWasAsked) {
  for (const char* const all : {"0.0.0.0:0", "[::]:0"}) {
    Peer server_end = server();
    Running proxy(server_end.address(), "", "", all);
    const std::string port = ":" + std::to_string(proxy.driver().local_address().port);
    std::vector<std::string> hosts = {"127.0.0.1", "127.0.0.2", "127.0.0.3"};
    if (std::string(all) == "[::]:0") hosts.emplace_back("[::1]");
    for (const std::string& host : hosts) {
      Peer client(UdpBatch::connected(parse_address(host + port)));
      SCOPED_TRACE(all + (' ' + host));
      expect_round_trip(client, server_end, "ping");
    }
  }
}

TEST(Driver, GoesOnToTheNextAddressOfAServerThatDoesNotAnswer) {
  Peer silent = server();  // never answers
  Address nobody;
  { nobody = server("[::1]:0").address(); }
  Peer server_end = server();
  Running proxy({nobody, silent.address(), server_end.address()}, "", "");
  Peer client = proxy.client();
  EXPECT_TRUE(eventually([&] {
    client.send("anyone?");
    return proxy.driver().status().server == server_end.address();
  }));
  client.send("you?");
  const auto got = server_end.receive();
  ASSERT_TRUE(got);
  server_end.send("I am", got->from);
  EXPECT_EQ(client.text(), "I am");
  // The proxy keeps this address even if the server is silent for longer.
  for (int i = 0; i < 120; ++i) {
    client.send("still there?");
    ::poll(nullptr, 0, 10);
  }
  const Status end = proxy.stop();
  EXPECT_EQ(end.server, server_end.address());
  EXPECT_FALSE(is_unanswered(end));
}

class NoMoreFiles {
 public:
  NoMoreFiles() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    rlimit few = before_;
    few.rlim_cur = std::min<rlim_t>(few.rlim_cur, 256);
    ::setrlimit(RLIMIT_NOFILE, &few);
    for (int fd = ::dup(0); fd >= 0; fd = ::dup(0)) held_.push_back(fd);
  }
  ~NoMoreFiles() {
    for (const int fd : held_) ::close(fd);
    ::setrlimit(RLIMIT_NOFILE, &before_);
  }
  NoMoreFiles(const NoMoreFiles&) = delete;
  NoMoreFiles& operator=(const NoMoreFiles&) = delete;

 private:
  rlimit before_{};
  std::vector<int> held_;
};

TEST(Driver, RefusesTheClientForWhichThereIsNoDescriptorAndServesTheOthers) {
  Peer server_end = server();
  Running proxy(server_end.address(), "");
  Peer first = proxy.client();
  Peer second = proxy.client();
  first.send("first");
  EXPECT_EQ(server_end.text(), "first");
  const auto refused = [&] { return proxy.driver().status().of(Direction::kUp).counters.refused_clients; };
  {
    const NoMoreFiles none;
    second.send("second");
    ASSERT_TRUE(eventually([&] { return refused() > 0; }));
    EXPECT_NE(proxy.driver().status().no_socket.find("Too many open files"), std::string::npos)
        << proxy.driver().status().no_socket;
    first.send("first again");
    EXPECT_EQ(server_end.text(), "first again");
  }
  second.send("second again");
  EXPECT_EQ(server_end.text(), "second again");
  EXPECT_EQ(proxy.stop().clients.size(), 2U);
}

TEST(Driver, ARebindForWhichThereIsNoDescriptorComesLaterAndIsTold) {
  Peer server_end = server();
  Running proxy(server_end.address(), "rebind(every=1ms)");
  Peer client = proxy.client();
  client.send("before");
  EXPECT_EQ(server_end.text(), "before");
  {
    const NoMoreFiles none;
    for (int i = 0; i < 20; ++i) {
      ::poll(nullptr, 0, 2);
      client.send("none");
      ASSERT_EQ(server_end.text(), "none");
    }
  }
  const Status end = proxy.stop();
  EXPECT_GT(end.late_rebinds, 0U);
  EXPECT_FALSE(why_invalid(end, 1h).empty());
}

TEST(Driver, MeasuresTheMachinesTimerWhileItRuns) {
  Peer server_end = server();
  Running proxy(server_end.address(), "");
  ASSERT_TRUE(eventually([&] { return proxy.driver().status().timer_floor.count() >= 3; }));
  const Status end = proxy.stop();
  EXPECT_GE(end.timer_floor.count(), 3U);
  EXPECT_GT(end.timer_floor.max(), 0ns);
}

}  // namespace
}  // namespace tendon::injector::driver_test
