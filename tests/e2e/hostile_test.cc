// SPDX-License-Identifier: Apache-2.0
// Invalid datagrams must only be counted. The counters are compared to the recorded datagrams, so it does not matter if
// the kernel drops some of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/run.h"
#include "protocol/wire/header.h"
#include "server/machine/udp_link.h"
#include "tests/e2e/stage/relay.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::hostile_test {
namespace {

using testing::ScratchFolder;

constexpr int kGarbage = 200;
constexpr int kOversized = 5;
constexpr std::size_t kOversizedBytes = 60'000;
constexpr int kCut = 10;

std::size_t below(std::mt19937_64& bits, std::size_t end) { return static_cast<std::size_t>(bits() % end); }

Datagram garbage(std::mt19937_64& bits, std::size_t size) {
  Datagram datagram(size);
  for (std::byte& byte : datagram) byte = static_cast<std::byte>(bits() & 0xFFU);
  return datagram;
}

/// Gives the server time to read its receive buffer. If the buffer is full, the kernel drops datagrams.
void breathe() { std::this_thread::sleep_for(std::chrono::milliseconds(1)); }

void wait_until_said(const Relay& relay, std::size_t count) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (relay.said().size() < count) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline) << "the client has fallen silent";
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

/// Counts the recorded datagrams that belong to no session. The recording contains only a sample of those.
std::uint64_t strangers_in(const std::vector<DatagramRecord>& arrived, const Address& client) {
  return static_cast<std::uint64_t>(std::count_if(arrived.begin(), arrived.end(), [&](const DatagramRecord& record) {
    if (record.size > kMaxDatagram) return true;
    const auto header = decode_header(std::span(record.bytes).first(record.size));
    if (header && header->type == DatagramType::kHello) return false;
    return !header || header->type != DatagramType::kData || record.peer != client;
  }));
}

TEST(HostileDatagrams, AreCountedAndChangeNothing) {
  const ScratchFolder folder;
  const auto file = folder.path() / "run.mcap";
  Server server(folder.path(), demo_scene(), {"--record", file.string()});
  const Address address = parse_address(server.address());
  Relay relay(address);
  Client wall("virtual_wall", to_string(relay.address()), folder.path());
  wall.wait_for_line("connected to falcon");
  ASSERT_NO_FATAL_FAILURE(wait_until_said(relay, 100));

  std::mt19937_64 bits(7);
  UdpLink stranger(parse_address("127.0.0.1:0"));
  for (int i = 0; i < kGarbage; ++i) {
    const Datagram datagram = garbage(bits, 1 + below(bits, kMaxDatagram));
    i % 2 == 0 ? stranger.send(address, datagram) : relay.forge(datagram);
    breathe();
  }
  for (int i = 0; i < kOversized; ++i) {
    const Datagram datagram = garbage(bits, kOversizedBytes);
    i % 2 == 0 ? stranger.send(address, datagram) : relay.forge(datagram);
    breathe();
  }
  const std::vector<Datagram> said = relay.said();
  for (const Datagram& datagram : said) {
    relay.forge(datagram);             // sends a copy from the address of the client
    stranger.send(address, datagram);  // sends a copy from another address
    relay.forge(std::span(datagram).first(below(bits, kHeaderSize)));
    breathe();
  }
  relay.cut_next(kCut);
  ASSERT_NO_FATAL_FAILURE(wait_until_said(relay, relay.said().size() + 200));
  wall.signal(SIGTERM);
  EXPECT_EQ(wall.wait(), 0);
  const std::string end = server.stop();

  const Recording recording = read_recording(file);
  expect_passive(recording, read_scene(demo_scene()));
  ASSERT_EQ(recording.losses, 0U);
  const std::uint64_t strangers = count_in(end, "malformed") + count_in(end, "unknown_connection");
  const std::uint64_t duplicated = count_in(end, "duplicated");
  const std::uint64_t sampled = strangers_in(recording.arrived, relay.clients_address());
  // The kernel may drop up to half of them.
  EXPECT_GE(strangers, static_cast<std::uint64_t>(kGarbage) / 2);
  EXPECT_GE(duplicated, said.size() / 2);
  EXPECT_LE(duplicated, said.size());
  EXPECT_GE(sampled, 1U);
  EXPECT_LT(sampled, strangers) << "the recording holds a sample";
  EXPECT_GE(sampled + count_in(end, "strangers_left_out"), strangers) << "and a count of the rest";
  EXPECT_GE(count_in(end, "lost"), static_cast<std::uint64_t>(kCut));  // truncated datagrams were not accepted

  EXPECT_EQ(count_in(end, "welcomed"), 1U);
  EXPECT_EQ(count_in(end, "refused"), 0U);
  EXPECT_EQ(wall.err().find("lost 127"), std::string::npos) << wall.err();
  std::uint64_t newest = 0;
  for (const StepRecord& step : recording.steps) {
    ASSERT_GE(step.force_sequence, newest);
    newest = step.force_sequence;
  }
  const auto last_stranger = std::find_if(recording.arrived.rbegin(), recording.arrived.rend(),
                                          [&](const DatagramRecord& d) { return d.peer == stranger.local_address(); });
  ASSERT_NE(last_stranger, recording.arrived.rend());
  const auto after = std::find_if(recording.steps.begin(), recording.steps.end(),
                                  [&](const StepRecord& step) { return step.hand.at >= last_stranger->at; });
  ASSERT_NE(after, recording.steps.end());
  EXPECT_GT(newest, after->force_sequence + 100);
}

TEST(HostileName, ForgesNoLineOfALogAndReachesNoTerminal) {
  const ScratchFolder folder;
  Server server(folder.path(), demo_scene());
  Options options{.client = {.name = "\x1b[2Jwall\n07:00:00.000 info the device is armed"}};
  options.server = server.address();
  options.duration = std::chrono::seconds(5);
  const std::jthread hostile([&] { run(options, [](const DeviceState&) { return Touch{}; }); });
  const std::string welcomed = server.process().wait_for_line("welcomed controller");
  Client wall("virtual_wall", server.address(), folder.path());
  const std::string refused = wall.wait_for_line("refused");
  for (const std::string& line : {welcomed, refused}) {
    EXPECT_NE(line.find(R"(\x1b[2Jwall\n07:00:00.000 info the device is armed)"), std::string::npos) << line;
    EXPECT_EQ(line.find('\x1b'), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace tendon::e2e::hostile_test
