// SPDX-License-Identifier: Apache-2.0
// These tests use a fake Avahi. deploy/discovery/drill uses a real one.
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/e2e/stage/threads.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/fake_avahi.h"

namespace tendon::e2e::discovery_test {
namespace {

using testing::FakeAvahi;

constexpr const char* kName = "falcon at bench 3";

/// Starts tendond on the address of its scene, which other machines can also reach.
class Tendond : public Process {
 public:
  Tendond(const std::filesystem::path& folder, std::vector<std::string> scenes, std::vector<std::string> environment)
      : Process(program("tendond"), std::move(scenes), folder, std::move(environment)) {}

  std::string stop() {
    signal(SIGTERM);
    EXPECT_EQ(wait(), 0) << err();
    return out().substr(out().find(R"({"event":"stopped")"));
  }
};

class Discovery : public ::testing::Test {
 protected:
  Discovery() : avahi(folder.path() / "bus"), environment{"DBUS_SYSTEM_BUS_ADDRESS=" + avahi.address()} {
    for (const std::string keys : {"keys", "other"}) {
      std::filesystem::create_directory(folder.path() / keys);
      Process keygen(program("tendond"), {"keygen", "wall", "--out", keys + "/wall.key"}, folder.path());
      if (keygen.wait() != 0) throw std::runtime_error(keygen.err());
      write(folder.path() / (keys + ".toml"),
            "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\n[network]\nkeys = \"" + keys +
                "\"\nlisten = \"0.0.0.0:0\"\n[discovery]\nannounce = true\n" + "name = \"" + kName + "\"\n");
    }
  }

  Tendond server(std::vector<std::string> scenes) {
    for (const char* const more : {"--json", "--duration-s", "120"}) scenes.emplace_back(more);
    return {folder.path(), std::move(scenes), environment};
  }

  void carry() {
    std::vector<FakeAvahi::Announced> all;
    for (const auto end = std::chrono::steady_clock::now() + kPatience;
         all.empty() && std::chrono::steady_clock::now() < end; all = avahi.announced()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    ASSERT_EQ(all.size(), 1U);
    avahi.put(all[0].name, {.port = all[0].port, .ip = "127.0.0.1", .txt = all[0].txt});
  }

  std::vector<std::string> to_the_name(std::vector<std::string> more) const {
    std::vector<std::string> arguments{"--server", std::string("dns-sd:") + kName, "--duration-s", "120"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }

  testing::ScratchFolder folder;
  FakeAvahi avahi;
  std::vector<std::string> environment;
};

TEST_F(Discovery, AServerIsFoundByNameAndAgainWhereItHasMoved) {
  Tendond first = server({"keys.toml"});
  carry();
  Process wall(program("virtual_wall"), to_the_name({"--key", "keys/wall.key"}), folder.path(), environment);
  wall.wait_for_line("connected to falcon at dns-sd:falcon at bench 3 (127.0.0.1:");
  EXPECT_EQ(count_in(first.stop(), "welcomed"), 1U);
  EXPECT_TRUE(avahi.announced().empty()) << "it is gone before the process is";
  Tendond second = server({"keys.toml"});
  carry();
  wall.wait_for_line("connected to falcon at dns-sd:falcon at bench 3 (127.0.0.1:");
  EXPECT_EQ(count_in(second.stop(), "welcomed"), 1U);
}

TEST_F(Discovery, AForgedInstanceGetsNoStateAndNoForce) {
  Tendond forged = server({"other.toml"});
  carry();
  Process wall(program("virtual_wall"), to_the_name({"--key", "keys/wall.key", "--json"}), folder.path(), environment);
  wall.wait_for_line("does it have this key");
  wall.signal(SIGTERM);
  EXPECT_EQ(wall.wait(), 1);
  for (const char* const what : {"sessions", "states", "forces"}) EXPECT_EQ(count_in(wall.out(), what), 0U) << what;
  const std::string end = forged.stop();
  EXPECT_EQ(count_in(end, "welcomed"), 0U);
  EXPECT_EQ(count_in(end, "forces"), 0U);
  EXPECT_GT(count_in(end, "hellos_unknown_key"), 0U);
}

TEST_F(Discovery, WithoutAKeyAClientDoesNotAskForAName) {
  Process wall(program("virtual_wall"), to_the_name({}), folder.path(), environment);
  EXPECT_EQ(wall.wait(), 1);
  EXPECT_NE(wall.err().find("expected a key (--key FILE)"), std::string::npos) << wall.err();
}

TEST_F(Discovery, ANameLeadsToItsOwnDeviceOfSeveral) {
  const std::string right = write(folder.path() / "right.toml",
                                  "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\n[discovery]\nannounce = true\n"
                                  "name = \"falcon at bench 3\"\n");
  const std::string left = write(folder.path() / "left.toml",
                                 "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\n"
                                 "[network]\nkeys = \"keys\"\nlisten = \"0.0.0.0:0\"\n");
  Tendond both = server({left, right});
  carry();
  Process wall(program("virtual_wall"), to_the_name({"--key", "keys/wall.key"}), folder.path(), environment);
  wall.wait_for_line("connected to falcon");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // time for forces to be sent
  wall.signal(SIGTERM);
  EXPECT_EQ(wall.wait(), 0);
  const std::string end = both.stop();
  const std::size_t of_right = end.find(R"("name":"right")");
  ASSERT_NE(of_right, std::string::npos) << end;
  EXPECT_GT(count_in(end.substr(of_right), "forces"), 0U) << end;
}

TEST_F(Discovery, OnlyASceneThatListsItHasItsThread) {
  Tendond announced = server({"keys.toml"});
  carry();
  EXPECT_TRUE(threads_of(announced.pid()).contains("announce"));
  EXPECT_TRUE(threads_of_the_page().contains("announce"));
}

}  // namespace
}  // namespace tendon::e2e::discovery_test
