// SPDX-License-Identifier: Apache-2.0
#include "tests/server/clients/sealed_server.h"

#include <cstddef>

namespace tendon::recorded_datagrams_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

struct Recorded {
  std::size_t strangers = 0;
  std::size_t clients = 0;
};
Recorded take_recorded(Mailboxes& mail, const Address& client) {
  Recorded recorded;
  for (; const DatagramRecord* datagram = mail.datagrams.front(); mail.datagrams.pop()) {
    ++(datagram->peer == client ? recorded.clients : recorded.strangers);
  }
  return recorded;
}

TEST_F(SealedServer, AFloodOfStrangersIsASampleAndACountAndClientsAreWhole) {
  Client client = opened(wall_, "198.51.100.1:1000");
  take_recorded(mail(), client.end->self);
  const Bytes junk(1200, std::byte{0x5a});
  const Bytes hello = wire_.front().bytes;  // without a cookie
  Bytes forged;                             // a datagram of the session, but the end was modified
  const std::size_t before = wire_.size();
  run(milliseconds(100), {&client});
  for (std::size_t i = before; i < wire_.size(); ++i) {
    if (wire_[i].to == server_) forged = wire_[i].bytes;
  }
  ASSERT_FALSE(forged.empty());
  forged.back() ^= std::byte{1};
  take_recorded(mail(), client.end->self);

  const std::size_t on_the_wire = wire_.size();
  constexpr int kFlood = 39;  // per millisecond, of each of three kinds
  run(seconds(1), {&client}, [&](Datagram& datagram) {
    if (datagram.from != client.end->self) return true;
    for (int i = 0; i < kFlood / 3; ++i) {
      deliver(parse_address("203.0.113.7:9"), junk);
      deliver(parse_address("203.0.113.7:9"), hello);
      deliver(parse_address("203.0.113.7:9"), forged);
    }
    return true;
  });
  std::size_t clients = 0;
  for (std::size_t i = on_the_wire; i < wire_.size(); ++i) {
    clients += wire_[i].from == client.end->self || wire_[i].to == client.end->self ? 1U : 0U;
  }
  const Recorded recorded = take_recorded(mail(), client.end->self);
  EXPECT_EQ(recorded.clients, clients);
  EXPECT_GE(recorded.strangers, 16U);
  EXPECT_LE(recorded.strangers, 2 * 16U) << "seconds begin where datagrams do";
  EXPECT_EQ(mail().datagrams_lost, 0U);
  EXPECT_EQ(mail().datagrams_over_budget, 0U);
  EXPECT_GT(mail().unauthenticated_left_out, 39'000U);
}

TEST_F(SealedServer, AClientThatSendsMoreThanTheBudgetIsCountedAndNotRecorded) {
  config_.recorded.bytes_per_s = 20'000;
  restart();
  Client client = controller(wall_, "198.51.100.1:1000");
  run(seconds(3), {&client});
  std::size_t bytes = 0;
  for (; const DatagramRecord* datagram = mail().datagrams.front(); mail().datagrams.pop()) bytes += datagram->size;
  EXPECT_LE(bytes, 4 * 20'000U);
  EXPECT_GE(bytes, 2 * 20'000U);
  EXPECT_GT(mail().datagrams_over_budget, 1000U);
}

}  // namespace
}  // namespace tendon::recorded_datagrams_test
