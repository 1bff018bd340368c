// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "protocol/wire/header.h"
#include "server/network_loop.h"
#include "tests/server/guests/sealed_server.h"
#include "tests/support/wire.h"

namespace tendon::shards_test {
namespace {

using std::chrono::milliseconds;

/// A sealed server with two shards and 40 devices, "d-0" to "d-39". There is one bank in the first shard, and there are
/// two in the second. As in UdpLink::several, data is delivered to the shard that owns the connection. All other
/// datagrams are delivered to the first shard.
class Shards : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kDevices = 40;

  struct Client {
    std::unique_ptr<End> end;
    std::unique_ptr<ForceClient> client;
  };

  Shards() {
    for (std::uint32_t i = 0; i < kDevices; ++i) {
      boxes_.push_back(std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 2, .flight = 2, .datagrams = 1024}));
      config_.devices.push_back(
          {.about = {.name = name(i), .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}},
           .mail = boxes_.back().get()});
    }
    config_.secret.fill(std::byte{7});
    config_.keys = {key_of("a", Role::kController, 1), key_of("b", Role::kController, 2)};
    config_.shard.of = 2;
    restart();
  }

  static std::string name(std::uint32_t device) { return "d-" + std::to_string(device); }

  void restart() {
    for (std::uint32_t i = 0; i < 2; ++i) {
      config_.shard.number = i;
      loops_[i] = std::make_unique<NetworkLoop>(config_, ends_[i], now_);
    }
  }

  Client come(std::size_t key, const std::string& device, std::uint16_t port, Role role = Role::kController) {
    Client client{std::make_unique<End>(wire_, parse_address("198.51.100.1:" + std::to_string(port))), nullptr};
    const ForceClient::Config config{.name = "guest", .device = device, .key = config_.keys[key].key, .seed = port};
    if (role == Role::kObserver) {
      client.client = std::make_unique<ForceClient>(
          *client.end, server_, config,
          [this, port](const DeviceState& state, const LinkStats&) { seen_[port].push_back(state.position.x()); },
          now_);
    } else {
      client.client = std::make_unique<ForceClient>(
          *client.end, server_, config,
          [this, port](const DeviceState& state) {
            seen_[port].push_back(state.position.x());
            return Touch(Vec3(state.position.x(), 0, 0));
          },
          now_);
    }
    return client;
  }

  void deliver(const Datagram& datagram, const std::vector<Client*>& clients) {
    for (Client* const client : clients) {
      if (datagram.to == client->end->self) client->end->inbox.push_back(datagram);
    }
    if (datagram.to != server_) return;
    const auto header = decode_header(datagram.bytes);
    const bool of_session = header && header->type == DatagramType::kData;
    ends_[of_session ? header->connection_id % 2 : 0].inbox.push_back(datagram);
  }

  /// `hands_on`: forwards each Hello to its shard.
  void run(Duration length, const std::vector<Client*>& clients, bool hands_on = true) {
    for (const LocalTime end = now_ + length; now_ < end; now_ += milliseconds(1)) {
      ++tick_;
      for (std::uint32_t i = 0; i < kDevices; ++i) {
        DeviceState state{.tick = tick_, .sampled = PeerTime(now_.time_since_epoch())};
        state.position.x() = i;
        boxes_[i]->state.put(state);
      }
      for (auto& loop : loops_) {
        loop->turn(now_);
        for (const NetworkLoop::Foreign& foreign : loop->take_foreign()) {
          ++handed_on_;
          if (hands_on) loops_.at(foreign.shard)->receive_foreign(now_, foreign.from, foreign.hello);
        }
      }
      for (Client* const client : clients) client->client->turn(now_);
      while (!wire_.empty()) {
        const Datagram datagram = std::move(wire_.front());
        wire_.pop_front();
        deliver(datagram, clients);
      }
    }
  }

  std::vector<std::string> take_notices(std::uint32_t shard) {
    std::vector<std::string> said;
    for (const auto& notice : loops_.at(shard)->take_notices()) said.push_back(notice.text);
    return said;
  }

  LocalTime now_{std::chrono::seconds(1000)};
  Address server_ = parse_address("198.51.100.9:47100");
  Wire wire_;
  std::array<End, 2> ends_ = {End(wire_, server_), End(wire_, server_)};
  std::vector<std::unique_ptr<Mailboxes>> boxes_;
  NetworkLoop::Config config_;
  std::array<std::unique_ptr<NetworkLoop>, 2> loops_;
  std::map<std::uint32_t, std::vector<double>> seen_;  ///< by client port: x of the states, which is the device index
  std::uint64_t tick_ = 0;
  int handed_on_ = 0;
};

TEST_F(Shards, EachLetsInWhoeverComesForItsDevices) {
  Client first = come(0, "d-15", 1);
  Client second = come(1, "d-16", 2);
  Client third = come(0, "d-3", 3);
  Client fourth = come(1, "d-39", 4);
  run(milliseconds(500), {&first, &second, &third, &fourth});
  EXPECT_EQ(loops_[0]->stats().welcomed, 2U);
  EXPECT_EQ(loops_[1]->stats().welcomed, 2U);
  EXPECT_EQ(handed_on_, 2);
  for (const auto& [port, place] :
       {std::pair(1U, 15.0), std::pair(2U, 16.0), std::pair(3U, 3.0), std::pair(4U, 39.0)}) {
    ASSERT_GT(seen_[port].size(), 300U);
    for (const double x : seen_[port]) EXPECT_EQ(x, place);
  }
  for (const std::uint32_t place : {15U, 16U, 3U, 39U}) {
    const RemoteForce* const force = boxes_[place]->forces[0].take();
    ASSERT_NE(force, nullptr);
    EXPECT_EQ(force->force.x(), place);
  }
  for (const auto& loop : loops_) {
    EXPECT_EQ(loop->stats().unknown_connection, 0U) << "an id is that of its shard";
    EXPECT_EQ(loop->stats().dropped.forged, 0U);
  }
}

TEST_F(Shards, AHelloThatIsLostOnItsWayToTheOtherShardIsSaidAgain) {
  Client client = come(0, "d-39", 1);
  run(milliseconds(150), {&client}, false);
  EXPECT_GE(handed_on_, 1);
  EXPECT_EQ(loops_[1]->stats().welcomed, 0U);
  run(milliseconds(300), {&client});
  EXPECT_EQ(loops_[1]->stats().welcomed, 1U);
}

// With equal ephemeral keys, two handshakes with one secret would expose both sessions.
TEST_F(Shards, NoTwoSessionsHaveTheSameAnswer) {
  std::vector<Bytes> answers;
  for (const char* const device : {"d-0", "d-16"}) {
    restart();
    Client client = come(0, device, 1);
    for (int i = 0; i < 5; ++i) {
      client.client->turn(now_);
      for (; !wire_.empty(); wire_.pop_front()) deliver(wire_.front(), {&client});
      for (auto& loop : loops_) {
        loop->turn(now_);
        for (const auto& foreign : loop->take_foreign()) {
          loops_.at(foreign.shard)->receive_foreign(now_, foreign.from, foreign.hello);
        }
      }
      const auto is_answer = [](const Datagram& datagram) {
        const auto header = decode_header(datagram.bytes);
        return header && header->type == DatagramType::kAnswer;
      };
      const auto answer = std::find_if(wire_.begin(), wire_.end(), is_answer);
      if (answer == wire_.end()) continue;
      answers.emplace_back(answer->bytes.begin() + kHeaderSize + sizeof(ClientRandom),
                           answer->bytes.begin() + kHeaderSize + sizeof(ClientRandom) + 32);
      break;
    }
    wire_.clear();
  }
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_NE(answers[0], answers[1]) << "the public half of its ephemeral key comes first";
}

TEST_F(Shards, ARefusalNamesTheDevicesOfAll) {
  Client client = come(0, "d-40", 1);
  run(milliseconds(150), {&client});
  const auto said = take_notices(0);
  ASSERT_FALSE(said.empty());
  EXPECT_NE(said[0].find("there is no device \"d-40\", only \"d-0\" to \"d-39\""), std::string::npos) << said[0];
  EXPECT_EQ(handed_on_, 0);
}

TEST_F(Shards, EachHasPlacesForObserversOfItsOwn) {
  config_.max_observers = 1;
  restart();
  Client first = come(0, "d-0", 1, Role::kObserver);
  Client second = come(1, "d-20", 2, Role::kObserver);
  Client third = come(0, "d-21", 3, Role::kObserver);
  run(milliseconds(500), {&first, &second, &third});
  EXPECT_GT(seen_[1].size(), 300U);
  EXPECT_GT(seen_[2].size(), 300U);
  EXPECT_TRUE(seen_[3].empty());
}

TEST_F(Shards, ADatagramIsRecordedOnceByTheFirstDeviceOfOne) {
  Client client = come(0, "d-20", 1);
  run(milliseconds(20), {&client});
  ASSERT_EQ(loops_[1]->stats().welcomed, 1U);
  std::map<std::size_t, int> hellos;
  std::map<std::size_t, int> answers;
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    for (const DatagramRecord* one = boxes_[i]->datagrams.front(); one != nullptr;
         boxes_[i]->datagrams.pop(), one = boxes_[i]->datagrams.front()) {
      const auto header = decode_header(std::span(one->bytes).first(one->size));
      ASSERT_TRUE(header.has_value());
      if (header->type == DatagramType::kHello) ++hellos[i];
      if (header->type == DatagramType::kAnswer) ++answers[i];
    }
  }
  EXPECT_EQ(hellos, (std::map<std::size_t, int>{{0, 2}})) << "without a cookie, and with one";
  EXPECT_EQ(answers, (std::map<std::size_t, int>{{16, 1}}));
}

TEST_F(Shards, TogetherTheirCountsAreThoseOfTheServer) {
  Client first = come(0, "d-3", 1);
  Client second = come(1, "d-30", 2);
  run(milliseconds(500), {&first, &second});
  NetworkLoop::Stats sum = loops_[0]->stats();
  sum += loops_[1]->stats();
  EXPECT_EQ(sum.welcomed, 2U);
  EXPECT_EQ(sum.forces, loops_[0]->stats().forces + loops_[1]->stats().forces);
  EXPECT_EQ(sum.hellos.retries, 2U);
  ASSERT_EQ(sum.channels.size(), kDevices);
  EXPECT_EQ(sum.channels[30].device, "d-30");
  EXPECT_EQ(sum.channels[3].forces + sum.channels[30].forces, sum.forces);
  EXPECT_EQ(sum.channels[30].holder, "guest");
}

TEST_F(Shards, AServerThatDialsHasItsPeerWhereTheDeviceIs) {
  config_.devices[20].dial = Peer::Config{.server = parse_address("198.51.100.7:1"), .name = "peer"};
  restart();
  for (std::uint32_t i = 0; i < 2; ++i) {
    loops_.at(i)->turn(now_);
    const auto goes_there = [](const Datagram& datagram) { return datagram.to == parse_address("198.51.100.7:1"); };
    EXPECT_EQ(std::count_if(wire_.begin(), wire_.end(), goes_there), i) << i;
  }
}

TEST_F(Shards, AShardThatCannotBeIsRefused) {
  for (const Shard shard : {Shard{0, 4}, Shard{0, 3}, Shard{2, 2}, Shard{0, 0}}) {
    config_.shard = shard;
    EXPECT_THROW(NetworkLoop(config_, ends_[0], now_), std::invalid_argument) << shard.number << " of " << shard.of;
  }
}

TEST(Shard, ShareTheBanksOfAServerWithoutAGap) {
  for (const std::size_t devices : {1U, 16U, 17U, 40U, 512U, 1000U, 1024U}) {
    for (std::uint32_t of = 1; of <= (devices + 15) / 16; of *= 2) {
      std::size_t end = 0;
      for (std::uint32_t number = 0; number < of; ++number) {
        const Shard shard{number, of};
        EXPECT_EQ(shard.first_device(devices), end);
        EXPECT_EQ(end % 16, 0U);
        end = shard.end_device(devices);
        EXPECT_GT(end, shard.first_device(devices)) << devices << " in " << of;
        EXPECT_EQ(shard.owner_of(shard.first_device(devices), devices), number);
        EXPECT_EQ(shard.owner_of(end - 1, devices), number);
      }
      EXPECT_EQ(end, devices);
    }
  }
}

}  // namespace
}  // namespace tendon::shards_test
