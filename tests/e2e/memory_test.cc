// SPDX-License-Identifier: Apache-2.0
// The bounds are 10 to 50 % above the measured values. An additional 100 kB per device or session must fail the tests.
// The goal for the whole server is 6 MB.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e::memory_test {
namespace {

constexpr std::int64_t kMegabyte = 1 << 20;

std::int64_t bytes(pid_t process, const std::string& row) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(row + ":")) return std::stoll(line.substr(row.size() + 1)) * 1024;
  }
  throw std::runtime_error("no " + row + " of process " + std::to_string(process));
}

std::int64_t faults(pid_t process) {
  std::ifstream stat("/proc/" + std::to_string(process) + "/stat");
  const std::string all{std::istreambuf_iterator<char>(stat), {}};
  std::istringstream words(all.substr(all.rfind(')') + 1));
  std::string word;
  for (int field = 3; field <= 10; ++field) words >> word;  // proc(5) counts from 1
  return std::stoll(word);
}

/// Returns the names of the shared libraries of a process, without the version. For example, "libz".
std::set<std::string> libraries(pid_t process) {
  std::set<std::string> names;
  std::ifstream maps("/proc/" + std::to_string(process) + "/maps");
  for (std::string line; std::getline(maps, line);) {
    const std::string file = line.substr(line.rfind('/') + 1);
    if (const std::size_t end = file.find(".so"); end != std::string::npos) names.insert(file.substr(0, end));
  }
  return names;
}

class Fleet {
 public:
  explicit Fleet(std::size_t count) {
    std::vector<std::string> scenes;
    for (std::size_t i = 0; i < count; ++i) {
      scenes.push_back(write(folder_.path() / ("hand-" + std::to_string(i) + ".toml"), kPressingHand));
    }
    server_ = std::make_unique<Server>(folder_.path(), scenes.front(),
                                       std::vector<std::string>(scenes.begin() + 1, scenes.end()));
    faults_ = faults(pid());
    Client watcher("echo_motion", server_->address(), folder_.path());
    for (int line = 0; line < 6; ++line) watcher.wait_for_line("position");
  }

  pid_t pid() { return server_->process().pid(); }
  const std::string& address() const { return server_->address(); }
  const std::filesystem::path& folder() const { return folder_.path(); }
  std::int64_t own() { return bytes(pid(), "RssAnon"); }
  std::int64_t faults_at_start() const { return faults_; }

 private:
  testing::ScratchFolder folder_;
  std::unique_ptr<Server> server_;
  std::int64_t faults_ = 0;
};

TEST(Memory, OfAServerWithADeviceIsSmall) {
  Fleet one(1);
  EXPECT_LT(bytes(one.pid(), "VmRSS"), 11 * kMegabyte);
  EXPECT_LT(one.own(), 5 * kMegabyte / 4);
  EXPECT_LT(one.faults_at_start(), 500);
}

TEST(Memory, HasNoLibraryThatTheSceneDoesNotNeed) {
  Fleet one(1);
  // The C++ libraries are linked statically. USB and discovery also load libusb and libsystemd, which have seven
  // dependencies.
  const std::set<std::string> needed = {"ld-linux-x86-64", "libc", "libgcc_s", "libm", "libz", "libsodium"};
  for (const std::string& library : libraries(one.pid())) EXPECT_TRUE(needed.contains(library)) << library;
}

TEST(Memory, OfAFurtherDeviceIsAQuarterOfAMegabyte) {
  Fleet one(1);
  Fleet nine(9);
  EXPECT_LT(nine.own() - one.own(), 8 * kMegabyte / 4);
  EXPECT_LT(nine.faults_at_start() - one.faults_at_start(), 8 * 100);
}

/// Waits until StepFlight is full.
void fill_the_flight() { std::this_thread::sleep_for(std::chrono::milliseconds(2500)); }

TEST(Memory, OfADeviceAtRestIsAHundredKilobytes) {
  const testing::ScratchFolder folder;
  const auto own = [&folder](int count) {
    const auto file = folder.path() / ("hand-" + std::to_string(count) + ".toml");
    Server server(
        folder.path(),
        write(file, "[device]\nkind = \"simulated\"\nprofile = \"falcon\"\ncount = " + std::to_string(count) + "\n"));
    Client watcher("echo_motion", server.address(), folder.path());
    for (int line = 0; line < 6; ++line) watcher.wait_for_line("position");
    fill_the_flight();
    return bytes(server.process().pid(), "RssAnon");
  };
  const std::int64_t of_one = (own(65) - own(1)) / 64;
  std::cout << of_one << " bytes of memory per device\n";
  EXPECT_LT(of_one, 160'000);
}

TEST(Memory, OfAFurtherSessionIsAFewPages) {
  Fleet one(1);
  const std::int64_t before = one.own();
  std::vector<std::unique_ptr<Client>> guests;
  for (int i = 0; i < 7; ++i) {
    guests.push_back(std::make_unique<Client>("echo_motion", one.address(), one.folder()));
    guests.back()->wait_for_line("position");
  }
  EXPECT_LT(one.own() - before, 7 * kMegabyte / 16);
}

TEST(Memory, OfAStepIsInPlaceBeforeItIsUsed) {
  Fleet one(1);
  if (bytes(one.pid(), "VmLck") == 0) GTEST_SKIP() << "no permission to lock memory";
  const std::string program = tendon::e2e::program("tendond");
  std::ifstream maps("/proc/" + std::to_string(one.pid()) + "/smaps");
  int of_the_program = 0;
  for (std::string line; std::getline(maps, line);) {
    if (!line.ends_with("/tendond")) continue;
    ++of_the_program;
    std::int64_t size = 0;
    std::int64_t resident = -1;
    for (std::string row; resident < 0 && std::getline(maps, row);) {
      if (row.starts_with("Size:")) size = std::stoll(row.substr(5));
      if (row.starts_with("Rss:")) resident = std::stoll(row.substr(4));
    }
    EXPECT_EQ(resident, size) << line;
  }
  EXPECT_GE(of_the_program, 3);
}

}  // namespace
}  // namespace tendon::e2e::memory_test
