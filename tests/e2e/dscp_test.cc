// SPDX-License-Identifier: Apache-2.0
// The marks of all datagrams of a session, as tcpdump sees them.
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <sstream>
#include <string>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::dscp_test {
namespace {

struct Seen {
  int all = 0;
  int marked = 0;
};

/// Runs a server and a client for a second. The client sends forces, and the server states.
Seen seen_on(const std::string& listen, const std::string& network, const std::vector<std::string>& of_client) {
  const testing::ScratchFolder folder;
  const auto scene = folder.path() / "device.toml";
  write(scene, std::string(kPressingHand) + "[network]\nlisten = \"" + listen + "\"\n" + network);
  Server server(folder.path(), scene);
  const std::string port = server.address().substr(server.address().rfind(':') + 1);
  Process tcpdump("/usr/bin/tcpdump",
                  {"-i", "lo", "-n", "-v", "-Z", "root", "--immediate-mode", "-c", "300", "udp port " + port},
                  folder.path());
  tcpdump.wait_for_line("listening on lo");
  Client wall("virtual_wall", server.address(), folder.path(), of_client);
  EXPECT_EQ(tcpdump.wait(), 0) << tcpdump.err();
  Seen seen;
  std::istringstream lines(tcpdump.out());
  for (std::string line; std::getline(lines, line);) {
    if (line.find(" IP (tos ") == std::string::npos && line.find(" IP6 (") == std::string::npos) continue;
    ++seen.all;
    // tcpdump does not print a class of 0.
    if (line.find("tos 0xb8") != std::string::npos || line.find("class 0xb8") != std::string::npos) ++seen.marked;
  }
  return seen;
}

TEST(Dscp, TcpdumpSeesTheMarkOnEachDatagramOfASession) {
  if (::geteuid() != 0 || !std::filesystem::exists("/usr/bin/tcpdump")) GTEST_SKIP() << "needs root and tcpdump";
  for (const char* const listen : {"127.0.0.1:0", "[::1]:0"}) {
    const Seen both = seen_on(listen, "dscp = \"ef\"\n", {"--dscp", "ef"});
    EXPECT_EQ(both.all, 300) << listen;
    EXPECT_EQ(both.marked, both.all) << listen;
    const Seen none = seen_on(listen, "", {});
    EXPECT_EQ(none.all, 300) << listen;
    EXPECT_EQ(none.marked, 0) << listen;
  }
  const Seen half = seen_on("127.0.0.1:0", "dscp = \"ef\"\n", {});
  EXPECT_GT(half.marked, 0);
  EXPECT_LT(half.marked, half.all) << "the client was not told";
}

}  // namespace
}  // namespace tendon::e2e::dscp_test
