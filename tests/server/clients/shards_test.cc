// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/clients/sealed_server.h"

namespace tendon::shards_test {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kDevices = 40;

/// Encrypted, with two shards and 40 devices, "d-0" to "d-39": one bank in the first shard, and two in the second.
class Shards : public SealedServer {
 protected:
  Shards() { restart_with_many(kDevices, 2); }

  Client come(const ClientKey& key, const std::string& device, std::uint16_t port) {
    const auto answer = [this, port](const DeviceState& state) {
      seen_[port].push_back(state.position.x());
      return Touch(Vec3(state.position.x(), 0, 0));
    };
    return controller(key, "198.51.100.1:" + std::to_string(port), {.device = device}, answer);
  }

  std::map<std::uint32_t, std::vector<double>> seen_;  ///< by client port: x of the states, which is the device index
};

TEST_F(Shards, EachLetsInWhoeverComesForItsDevices) {
  Client first = come(wall_, "d-15", 1);
  Client second = come(other_, "d-16", 2);
  Client third = come(wall_, "d-3", 3);
  Client fourth = come(other_, "d-39", 4);
  run(milliseconds(500), {&first, &second, &third, &fourth});
  for (const auto& [port, place] :
       {std::pair(1U, 15.0), std::pair(2U, 16.0), std::pair(3U, 3.0), std::pair(4U, 39.0)}) {
    ASSERT_GT(seen_[port].size(), 300U);
    for (const double x : seen_[port]) EXPECT_EQ(x, place);
  }
  for (const std::uint32_t place : {15U, 16U, 3U, 39U}) {
    const RemoteForce* const force = mail(place).forces[0].take();
    ASSERT_NE(force, nullptr);
    EXPECT_EQ(force->force.x(), place);
  }
  for (const std::size_t shard : {0U, 1U}) {
    EXPECT_EQ(stats(shard).welcomed, 2U);
    EXPECT_EQ(stats(shard).unknown_connection, 0U) << "an id is that of its shard";
    EXPECT_EQ(stats(shard).dropped.forged, 0U);
  }
  EXPECT_EQ(stats(1).hellos.retries, 0U) << "the first shard has asked for the cookies";
}

TEST_F(Shards, AHelloThatIsLostOnItsWayToTheOtherShardIsSaidAgain) {
  Client client = come(wall_, "d-39", 1);
  std::size_t lost = 0;
  for (int ms = 0; ms < 150; ++ms) {
    run(milliseconds(1), {&client});
    loop().turn(now_);
    lost += loop().take_foreign().size();
  }
  EXPECT_GE(lost, 1U);
  EXPECT_EQ(stats(1).welcomed, 0U);
  run(milliseconds(300), {&client});
  EXPECT_EQ(stats(1).welcomed, 1U);
}

// With equal ephemeral keys, two handshakes with one secret would expose both sessions.
TEST_F(Shards, NoTwoSessionsHaveTheSameAnswer) {
  std::vector<Bytes> answers;
  for (const char* const device : {"d-0", "d-16"}) {
    now_ = LocalTime(std::chrono::seconds(1000));
    seed_ = 10;
    restart();
    Client client = come(wall_, device, 1);
    run(milliseconds(20), {&client}, [&](const Datagram& datagram) {
      const auto header = decode_header(datagram.bytes);
      if (header && header->type == DatagramType::kAnswer) {
        const auto key = datagram.bytes.begin() + kHeaderSize + sizeof(ClientRandom);
        answers.emplace_back(key, key + 32);
      }
      return true;
    });
  }
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_NE(answers[0], answers[1]) << "the public half of its ephemeral key comes first";
}

TEST_F(Shards, ARefusalNamesTheDevicesOfAll) {
  Client client = come(wall_, "d-40", 1);
  run(milliseconds(150), {&client});
  const auto said = take_notices();
  ASSERT_FALSE(said.empty());
  EXPECT_NE(said[0].find("there is no device \"d-40\", only \"d-0\" to \"d-39\""), std::string::npos) << said[0];
  EXPECT_TRUE(take_notices(1).empty()) << "it was not handed on";
}

TEST_F(Shards, EachHasPlacesForObserversOfItsOwn) {
  scenes_[0].network.max_observers = 1;
  restart();
  Client first = observer(wall_, "198.51.100.1:1", {.device = "d-0"});
  Client second = observer(other_, "198.51.100.1:2", {.device = "d-20"});
  Client third = observer(wall_, "198.51.100.1:3", {.device = "d-21"});
  run(milliseconds(500), {&first, &second, &third});
  EXPECT_GT(first->stats().states, 300U);
  EXPECT_GT(second->stats().states, 300U);
  EXPECT_EQ(third->stats().states, 0U);
}

TEST_F(Shards, ADatagramIsRecordedOnceByTheFirstDeviceOfOne) {
  Client client = come(wall_, "d-20", 1);
  run(milliseconds(20), {&client});
  ASSERT_EQ(stats(1).welcomed, 1U);
  std::map<std::size_t, int> hellos;
  std::map<std::size_t, int> answers;
  for (std::size_t i = 0; i < kDevices; ++i) {
    for (; const DatagramRecord* one = mail(i).datagrams.front(); mail(i).datagrams.pop()) {
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
  Client first = come(wall_, "d-3", 1);
  Client second = come(other_, "d-30", 2);
  run(milliseconds(500), {&first, &second});
  NetworkLoop::Stats sum = stats(0);
  sum += stats(1);
  EXPECT_EQ(sum.welcomed, 2U);
  EXPECT_EQ(sum.forces, stats(0).forces + stats(1).forces);
  EXPECT_EQ(sum.hellos.retries, 2U);
  ASSERT_EQ(sum.channels.size(), kDevices);
  EXPECT_EQ(sum.channels[30].device, "d-30");
  EXPECT_EQ(sum.channels[3].forces + sum.channels[30].forces, sum.forces);
  EXPECT_EQ(sum.channels[30].holder, "other");
}

TEST_F(Shards, AServerThatDialsHasItsPeerWhereTheDeviceIs) {
  scenes_[20] = device_named("d-20",
                             "[teleoperation]\nrole = \"leader\"\ndial = \"127.0.0.1:1\"\n[teleoperation.energy_tank]\n"
                             "[teleoperation.coupling]\nstiffness_n_per_m = 400\ndamping_n_s_per_m = 4\n");
  restart();
  for (std::uint32_t i = 0; i < 2; ++i) {
    loop(i).turn(now_);
    const auto goes_there = [](const Datagram& datagram) { return datagram.to == parse_address("127.0.0.1:1"); };
    EXPECT_EQ(std::count_if(wire_.begin(), wire_.end(), goes_there), i) << i;
  }
}

TEST_F(Shards, AShardThatCannotBeIsRefused) {
  for (std::uint32_t i = 0; i < kDevices; ++i) config_.devices.push_back({.about = {.name = "d"}, .mail = &mail()});
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
