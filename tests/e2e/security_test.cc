// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <memory>
#include <string>

#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::security_test {
namespace {

using testing::ScratchFolder;

/// The server has keys for `wall` and for the observer `screen`, and listens on all addresses.
class Lab {
 public:
  Lab() {
    std::filesystem::create_directory(folder_.path() / "keys");
    keygen({"wall", "--out", "keys/wall.key"});
    keygen({"screen", "--observer", "--out", "keys/screen.key"});
    keygen({"stranger"});
    scene_ = write(folder_.path() / "lab.toml",
                   "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\n"
                   "[network]\nkeys = \"keys\"\nlisten = \"0.0.0.0:0\"\n");
  }
  void keygen(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "keygen");
    Process process(program("tendond"), arguments, folder_.path());
    ASSERT_EQ(process.wait(), 0) << process.err();
  }
  const std::filesystem::path& folder() const { return folder_.path(); }
  const std::string& scene() const { return scene_; }
  std::string key(const std::string& name) const { return (folder_.path() / "keys" / (name + ".key")).string(); }

 private:
  ScratchFolder folder_;
  std::string scene_;
};

std::string on_this_machine(const std::string& address) { return "127.0.0.1" + address.substr(address.rfind(':')); }

TEST(Security, AClientWithItsKeyControlsAndAnObserverWatches) {
  Lab lab;
  Server server(lab.folder(), lab.scene());
  const std::string address = on_this_machine(server.address());
  Client wall("virtual_wall", address, lab.folder(), {"--key", lab.key("wall")});
  wall.wait_for_line("connected to falcon");
  Client screen("echo_motion", address, lab.folder(), {"--key", lab.key("screen")});
  screen.wait_for_line("connected to falcon");
  screen.signal(SIGTERM);
  EXPECT_EQ(screen.wait(), 0);
  wall.signal(SIGTERM);
  EXPECT_EQ(wall.wait(), 0);
  const std::string end = server.stop();
  EXPECT_EQ(count_in(end, "welcomed"), 2U);
  for (const char* const cause :
       {"forged", "old_key", "hellos_plain", "hellos_limited", "hellos_unknown_key", "hellos_forged"}) {
    EXPECT_EQ(count_in(end, cause), 0U) << cause;
  }
  // Each client sends Bye three times. If a copy arrives in a later turn, it does not belong to a session.
  EXPECT_LE(count_in(end, "unknown_connection"), 4U);
}

TEST(Security, ThePermissionToWriteToTheSocketsFileIsAKey) {
  Lab lab;
  const std::string scene = write(lab.folder() / "near.toml",
                                  "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\n"
                                  "[network]\nkeys = \"keys\"\nlisten = \"0.0.0.0:0\"\nunix = \"near.sock\"\n");
  Server server(lab.folder(), scene);
  Client wall("virtual_wall", "unix:near.sock", lab.folder());
  wall.wait_for_line("connected to falcon");
  Client screen("echo_motion", "unix:" + (lab.folder() / "near.sock").string(), lab.folder());
  screen.wait_for_line("position");
  Client plain("virtual_wall", on_this_machine(server.address()), lab.folder());
  EXPECT_EQ(plain.wait(), 1);
  EXPECT_NE(plain.err().find("this server only accepts clients with a key: use --key FILE"), std::string::npos)
      << plain.err();
  wall.signal(SIGTERM);
  EXPECT_EQ(wall.wait(), 0);
  EXPECT_EQ(count_in(server.stop(), "welcomed"), 2U);
  EXPECT_FALSE(std::filesystem::exists(lab.folder() / "near.sock"));
}

TEST(Security, AClientOfASocketsFileFindsTheServerAgainThatIsStartedAnew) {
  const ScratchFolder folder;
  const std::string scene = write(folder.path() / "near.toml",
                                  "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\n"
                                  "[network]\nunix = \"near.sock\"\n");
  auto server = std::make_unique<Server>(folder.path(), scene);
  Client wall("virtual_wall", "unix:near.sock", folder.path());
  wall.wait_for_line("connected to falcon");
  server->process().signal(SIGKILL);
  server.reset();
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "near.sock")) << "a killed server leaves its file";
  Server next(folder.path(), scene);
  wall.wait_for_line("connected to falcon");
}

TEST(Security, WithoutAKeyOrWithTheWrongOneNobodyGetsIn) {
  Lab lab;
  Server server(lab.folder(), lab.scene());
  const std::string address = on_this_machine(server.address());
  Client plain("virtual_wall", address, lab.folder());
  EXPECT_EQ(plain.wait(), 1);
  EXPECT_NE(plain.err().find("this server only accepts clients with a key: use --key FILE"), std::string::npos)
      << plain.err();
  Client stranger("virtual_wall", address, lab.folder(), {"--key", (lab.folder() / "stranger.key").string()});
  stranger.wait_for_line("does it have this key");
  stranger.signal(SIGTERM);
  EXPECT_EQ(stranger.wait(), 1);
  Client screen("virtual_wall", address, lab.folder(), {"--key", lab.key("screen")});
  EXPECT_EQ(screen.wait(), 1);
  EXPECT_NE(screen.err().find("only permits observers"), std::string::npos) << screen.err();
  const std::string end = server.stop();
  EXPECT_EQ(count_in(end, "welcomed"), 0U);
  EXPECT_GT(count_in(end, "hellos_unknown_key"), 0U);
}

TEST(Security, AKilledControllerComesBackWithItsKeyWithoutWaiting) {
  Lab lab;
  Server server(lab.folder(), lab.scene());
  const std::string address = on_this_machine(server.address());
  Client first("virtual_wall", address, lab.folder(), {"--key", lab.key("wall")});
  first.wait_for_line("connected to falcon");
  Client second("virtual_wall", address, lab.folder(), {"--key", lab.key("wall")});
  second.wait_for_line("connected to falcon");
  EXPECT_EQ(first.wait(), 1);
  EXPECT_NE(first.err().find("a program with the same key has replaced this session"), std::string::npos)
      << first.err();
  second.signal(SIGTERM);
  EXPECT_EQ(second.wait(), 0);
  EXPECT_EQ(count_in(server.stop(), "replaced"), 1U);
}

TEST(Security, AKeyThatOthersMayReadIsRefusedByServerAndClient) {
  Lab lab;
  std::filesystem::permissions(lab.key("wall"), std::filesystem::perms(0644));
  Process server(program("tendond"), {lab.scene(), "--duration-s", "1"}, lab.folder());
  EXPECT_EQ(server.wait(), 1);
  EXPECT_NE(server.err().find("wall.key: other users can read or write this key"), std::string::npos) << server.err();
  Process client(program("virtual_wall"), {"--key", lab.key("wall")}, lab.folder());
  EXPECT_EQ(client.wait(), 1);
  EXPECT_NE(client.err().find("wall.key: other users can read or write this key"), std::string::npos) << client.err();
}

TEST(Security, KeygenSaysWhereTheKeyGoesAndWhatTheSceneNeeds) {
  const ScratchFolder folder;
  Process keygen(program("tendond"), {"keygen", "wall"}, folder.path());
  EXPECT_EQ(keygen.wait(), 0);
  for (const char* const line :
       {"cp wall.key keys/\n", "[network]\n", "keys = \"keys\"\n", "--key wall.key --server "}) {
    EXPECT_NE(keygen.err().find(line), std::string::npos) << keygen.err();
  }
}

TEST(Security, KeygenRefusesANameThatIsNoneAndAFileThatIsThere) {
  Lab lab;
  for (const std::string name : {"../wall", "a b"}) {
    Process process(program("tendond"), {"keygen", name}, lab.folder());
    EXPECT_EQ(process.wait(), 2) << name;
    EXPECT_NE(process.err().find("letters, digits"), std::string::npos) << process.err();
  }
  Process again(program("tendond"), {"keygen", "stranger"}, lab.folder());
  EXPECT_EQ(again.wait(), 1);
  EXPECT_NE(again.err().find("File exists"), std::string::npos) << again.err();
}

}  // namespace
}  // namespace tendon::e2e::security_test
