// SPDX-License-Identifier: Apache-2.0
// A client whose thread reads each datagram late, with and without the time stamps of the kernel.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "clients/cpp/force_client.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/udp_transport.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::stamps_test {
namespace {

using std::chrono::microseconds;

constexpr Duration kLate = microseconds(500);

/// A link that does not pass on the time stamps.
class Unstamped : public Link {
 public:
  explicit Unstamped(Link& link) : link_(link) {}
  void send(const Address& to, std::span<const std::byte> datagram) override { link_.send(to, datagram); }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override { return link_.receive(from, buffer); }
  LocalTime present(LocalTime now) const override { return link_.present(now); }

 private:
  Link& link_;
};

/// Returns the median round trip of about a second.
Duration round_trip(const ServerName& server, bool stamps) {
  UdpTransport transport(server);
  Unstamped unstamped(transport);
  const LocalTime end = read_clock() + std::chrono::seconds(10);  // only reached if the test fails
  ForceClient client(
      stamps ? static_cast<Link&>(transport) : unstamped, transport.server(), {},
      [](const DeviceState& /*hand*/) -> Touch { return Vec3(1, 0, 0); }, read_clock());
  std::vector<Duration> samples;
  for (LocalTime next = client.turn(read_clock()); samples.size() < 500 && read_clock() < end;) {
    transport.wait(next - read_clock());
    std::this_thread::sleep_for(kLate);
    next = client.turn(read_clock());
    const Duration sample = client.stats().link.round_trip;
    if (sample > Duration::zero()) samples.push_back(sample);
  }
  client.stop(read_clock());
  EXPECT_EQ(samples.size(), 500U);
  if (samples.empty()) return {};
  std::nth_element(samples.begin(), samples.begin() + samples.size() / 2, samples.end());
  return samples[samples.size() / 2];
}

TEST(Stamps, TheRoundTripOfALateThreadDoesNotContainItsWakeUps) {
  const testing::ScratchFolder folder;
  const std::string file = (folder.path() / "socket").string();
  const auto scene = folder.path() / "device.toml";
  write(scene, std::string(kPressingHand) + "[network]\nunix = \"" + file + "\"\n");
  Server server(folder.path(), scene);
  for (const std::string& name : {server.address(), "unix:" + file}) {
    const Duration with = round_trip(name, true);
    const Duration without = round_trip(name, false);
    EXPECT_GE(without, kLate) << name;
    EXPECT_LT(with, without - kLate / 2) << name;
  }
  const std::string stopped = server.stop();
  EXPECT_LT(count_in(stopped, "stamps_refused"), 500U) << "of more than 2000";
}

}  // namespace
}  // namespace tendon::e2e::stamps_test
