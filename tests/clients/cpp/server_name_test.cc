// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/server_name.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "clients/cpp/udp_transport.h"
#include "tests/support/refusal.h"

namespace tendon::server_name_test {
namespace {

TEST(ServerName, OfASocketsFileIsItsPath) {
  const ServerName name = "unix:/run/tendon.sock";
  EXPECT_EQ(name.unix_path(), "/run/tendon.sock");
  const auto [addresses, device] = name.look_up();
  ASSERT_EQ(addresses.size(), 1U);
  EXPECT_TRUE(is_loopback(addresses.front()));
  EXPECT_EQ(name.at(addresses.front()), name.text());
  EXPECT_EQ(ServerName("unix:" + std::string(107, 'x')).unix_path().size(), 107U);
  EXPECT_EQ(ServerName("127.0.0.1:47100").unix_path(), "");
}

TEST(ServerName, OfASocketsFileHasAPathThatASocketCanHave) {
  for (const std::string& path : {std::string(), std::string(108, 'x')}) {
    EXPECT_EQ(thrown_by([&] { ServerName("unix:" + path); }),
              "expected unix:PATH with a path of 1 to 107 bytes, like unix:/run/tendon.sock, got \"unix:" + path + '"');
  }
}

TEST(ServerName, AnAddressIsItsOwn) {
  for (const std::string text : {"127.0.0.1:47100", "[::1]:5000", "192.0.2.7:0"}) {
    const ServerName name(text);
    ASSERT_EQ(name.look_up().addresses.size(), 1U) << text;
    EXPECT_EQ(to_string(name.look_up().addresses.front()), text);
    EXPECT_EQ(name.at(name.look_up().addresses.front()), text);
  }
}

TEST(ServerName, TheSystemLooksAHostNameUp) {
  // parse_address() only accepts numeric addresses and "localhost" in lower case, so /etc/hosts is used.
  const auto addresses = ServerName("LOCALHOST:47100").look_up().addresses;
  ASSERT_FALSE(addresses.empty());
  for (const Address& address : addresses) {
    EXPECT_TRUE(is_loopback(address)) << to_string(address);
    EXPECT_EQ(address.port, 47100);
  }
}

TEST(ServerName, AHostThatIsNotThereIsNamed) {
  EXPECT_TRUE(thrown_by<std::runtime_error>([&] {
                ServerName("haptics.invalid:47100").look_up();
              }).starts_with("cannot find haptics.invalid: "));
  EXPECT_THROW(UdpTransport("haptics.invalid:47100"), std::runtime_error);
}

TEST(ServerName, RefusesWhatIsNotAHostAndAPort) {
  for (const std::string text : {"nowhere", "haptics.lab", "haptics.lab:", "haptics.lab:65536", "haptics.lab:-1",
                                 ":47100", "::1:47100", "[haptics]:1", "a b:1", "-x:1", "haptics.lab:1:2", "a/b:1"}) {
    EXPECT_THROW(ServerName{text}, std::invalid_argument) << text;
  }
  std::string longer_than_dns_has(254, 'a');
  longer_than_dns_has.append(":1");
  EXPECT_THROW(ServerName{longer_than_dns_has}, std::invalid_argument);
}

TEST(ServerName, TellsTheAddressThatANameHas) {
  EXPECT_EQ(ServerName("haptics.lab:1").at(parse_address("192.0.2.7:1")), "haptics.lab:1 (192.0.2.7:1)");
}

}  // namespace
}  // namespace tendon::server_name_test
