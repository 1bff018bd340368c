// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/cpp/discovery/discovery.h"
#include "clients/cpp/discovery/list.h"
#include "clients/cpp/machine.h"
#include "clients/cpp/server_name.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/fake_avahi.h"
#include "tests/support/refusal.h"

namespace tendon::avahi_test {
namespace {

using testing::FakeAvahi;

constexpr const char* kBus = "DBUS_SYSTEM_BUS_ADDRESS";

class AvahiDiscovery : public ::testing::Test {
 protected:
  AvahiDiscovery() : avahi(folder.path() / "bus") { ::setenv(kBus, avahi.address().c_str(), 1); }
  ~AvahiDiscovery() override { ::unsetenv(kBus); }

  static std::string problem_with(const std::string& server, bool has_key = true) {
    return thrown_by<std::runtime_error>([&] { ServerName(server).look_up(has_key); });
  }

  testing::ScratchFolder folder;
  FakeAvahi avahi;
};

TEST_F(AvahiDiscovery, ANameLeadsToItsAddressAndItsDevice) {
  avahi.put("falcon v1.2", {.port = 47100, .ip = "192.0.2.7", .txt = {"device=left"}});
  for (const std::string server : {"dns-sd:falcon v1\\.2", "tendon://falcon v1\\.2", "dns-sd:falcon v1\\.2.local"}) {
    const ServerName::Place place = ServerName(server).look_up(true);
    ASSERT_EQ(place.addresses.size(), 1U);
    EXPECT_EQ(to_string(place.addresses[0]), "192.0.2.7:47100");
    EXPECT_EQ(place.device, "left");
  }
}

TEST_F(AvahiDiscovery, AnAddressThatLeadsNowhereIsNone) {
  avahi.put("six", {.port = 5, .ip = "2001:db8::7"});
  EXPECT_EQ(to_string(ServerName("dns-sd:six").look_up(true).addresses.at(0)), "[2001:db8::7]:5");
  avahi.put("near", {.port = 5, .ip = "fe80::7"});
  EXPECT_NE(problem_with("dns-sd:near").find("no reply on this network"), std::string::npos);
}

TEST_F(AvahiDiscovery, WithoutAKeyNoNameIsLookedUp) {
  avahi.put("falcon", {.port = 47100, .ip = "192.0.2.7"});
  EXPECT_EQ(problem_with("dns-sd:falcon", false),
            "dns-sd:falcon: anyone can announce this name, and only a key proves the identity of the server: expected "
            "a key (--key FILE), or HOST:PORT instead of the name");
}

TEST_F(AvahiDiscovery, WhoeverIsMissingIsNamed) {
  EXPECT_EQ(problem_with("dns-sd:falcon at bench 3"),
            "cannot find dns-sd:falcon at bench 3: no reply on this network for falcon at bench 3._tendon._udp.local. "
            "Use --server dns-sd: to list all devices");
  avahi.set_absent(true);
  EXPECT_EQ(problem_with("dns-sd:falcon"),
            "cannot search for dns-sd:falcon: avahi-daemon does not respond (org.freedesktop.Avahi is not there). "
            "Expected a running avahi-daemon, or HOST:PORT instead of a name");
  ::setenv(kBus, "unix:path=/nowhere", 1);
  EXPECT_EQ(problem_with("dns-sd:falcon"),
            "cannot search for dns-sd:falcon: there is no D-Bus system bus (No such file or directory). Expected a "
            "running avahi-daemon, or HOST:PORT instead of a name");
  EXPECT_THROW(dns_sd::browse_by_avahi(), std::runtime_error);
}

TEST_F(AvahiDiscovery, ASilentAvahiIsLeftAfterSomeSeconds) {
  avahi.set_silent(true);
  const LocalTime start = read_clock();
  EXPECT_NE(problem_with("dns-sd:falcon").find("no reply on this network"), std::string::npos);
  EXPECT_GE(read_clock() - start, std::chrono::seconds(3));
}

TEST_F(AvahiDiscovery, AListHasEachNameOnceAndNothingThatATerminalObeys) {
  avahi.put("falcon v1.2",
            {.port = 47100, .ip = "192.0.2.7", .txt = {"v=1", "device=left", "hz=1000", "channels=a,b"}});
  avahi.put("evil", {.port = 1, .ip = "192.0.2.8", .txt = {"device=\x1B[2J"}, .host = "\x1B[2J"});
  avahi.put("\x1B[2J", {.port = 1, .ip = "192.0.2.8"});
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(list_servers("dns-sd:", false), 0);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(),
            "dns-sd:evil\n"
            "dns-sd:falcon v1\\.2  left, 1000 Hz, channels a b, at bench.local:47100\n");
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(list_servers("dns-sd:", true), 0);
  EXPECT_NE(
      ::testing::internal::GetCapturedStdout().find(
          R"({"server":"dns-sd:falcon v1\\.2","device":"left","hz":1000,"suite":0,"channels":["a","b"],"version":1,)"
          R"("host":"bench.local","port":47100})"),
      std::string::npos);
  EXPECT_EQ(list_servers("dns-sd:evil", false), std::nullopt);
  EXPECT_EQ(list_servers("127.0.0.1:1", false), std::nullopt);
}

TEST_F(AvahiDiscovery, OfAThousandAllAreListedAndTheFirstDescribed) {
  for (int i = 0; i < 1000; ++i) avahi.put("falcon " + std::to_string(i), {.port = 47100, .ip = "192.0.2.7"});
  const std::vector<dns_sd::Found> all = dns_sd::browse_by_avahi();
  ASSERT_EQ(all.size(), 1000U);
  std::size_t described = 0;
  for (const dns_sd::Found& found : all) described += found.port == 47100 ? 1 : 0;
  EXPECT_EQ(described, dns_sd::kDescribed);
}

}  // namespace
}  // namespace tendon::avahi_test
