// SPDX-License-Identifier: Apache-2.0
#include "server/machine/announcer.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/server/scratch_folder.h"
#include "tests/support/fake_avahi.h"
#include "tests/support/refusal.h"

namespace tendon::announcer_test {
namespace {

using testing::FakeAvahi;

const dns_sd::About kFalcon{.version = 1, .device = "left", .hz = 1000, .suite = 1, .channels = {"main"}};

class Running {
 public:
  explicit Running(std::vector<Announcer::Device> devices, const std::string& listen = "0.0.0.0:47100")
      : announcer_(std::move(devices), parse_address(listen),
                   [this](bool warning, const std::string& sentence) {
                     const std::lock_guard lock(mutex_);
                     (warning ? warnings_ : news_).push_back(sentence);
                   }),
        thread_([this] { announcer_.run(); }) {}
  ~Running() {
    announcer_.stop();
    thread_.join();
  }

  std::vector<std::string> news() { return copy(news_); }
  std::vector<std::string> warnings() { return copy(warnings_); }

 private:
  std::vector<std::string> copy(const std::vector<std::string>& list) {
    const std::lock_guard lock(mutex_);
    return list;
  }

  std::mutex mutex_;
  std::vector<std::string> news_;
  std::vector<std::string> warnings_;
  Announcer announcer_;
  std::thread thread_;
};

bool soon(const std::function<bool()>& holds) {
  for (int i = 0; i < 2000 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return holds();
}

class Announcing : public ::testing::Test {
 protected:
  Announcing() : avahi(folder.path() / "bus") { ::setenv("DBUS_SYSTEM_BUS_ADDRESS", avahi.address().c_str(), 1); }
  ~Announcing() override { ::unsetenv("DBUS_SYSTEM_BUS_ADDRESS"); }

  std::vector<std::string> names() {
    std::vector<std::string> all;
    for (const auto& one : avahi.announced()) all.push_back(one.name);
    return all;
  }

  testing::ScratchFolder folder;
  FakeAvahi avahi;
};

using Names = std::vector<std::string>;

TEST_F(Announcing, EachDeviceHasAnInstanceUntilTheEnd) {
  {
    Running running({{"left at bench", kFalcon}, {"right at bench", kFalcon}});
    ASSERT_TRUE(soon([&] { return names() == Names{"left at bench", "right at bench"}; }));
    EXPECT_EQ(avahi.announced().front(),
              (FakeAvahi::Announced{.interface = -1,
                                    .protocol = 0,
                                    .name = "left at bench",
                                    .type = "_tendon._udp",
                                    .port = 47100,
                                    .txt = {"v=1", "device=left", "hz=1000", "suite=1", "channels=main"}}));
    ASSERT_TRUE(soon([&] { return running.news().size() == 2; }));
    EXPECT_EQ(running.news().front(), "announced as \"left at bench\" (_tendon._udp, port 47100)");
    EXPECT_EQ(running.warnings(), Names{});
  }
  EXPECT_TRUE(soon([&] { return names().empty(); }));
}

TEST_F(Announcing, ATakenNameIsFollowedByTheNextOne) {
  avahi.occupy("falcon");
  avahi.occupy("falcon #2");
  Running running({{"falcon", kFalcon}});
  ASSERT_TRUE(soon([&] { return names() == Names{"falcon #3"}; }));
  ASSERT_TRUE(soon([&] { return running.news().size() == 1; }));
  EXPECT_EQ(running.news().front(),
            "announced as \"falcon #3\" (_tendon._udp, port 47100), because \"falcon\" is taken");
}

TEST_F(Announcing, WithoutAvahiItSaysSoOnceAndAnnouncesWhenItComes) {
  avahi.set_absent(true);
  Running running({{"left", kFalcon}, {"right", kFalcon}});
  ASSERT_TRUE(soon([&] { return !running.warnings().empty(); }));
  avahi.come_back();
  ASSERT_TRUE(soon([&] { return names() == Names{"left", "right"}; }));
  EXPECT_EQ(running.warnings(),
            Names{"not announced ([discovery]): avahi-daemon refused the announcement (org.freedesktop.Avahi is not "
                  "there). Expected a running avahi-daemon; clients can still use the address of this server"});
}

TEST_F(Announcing, AnAvahiThatWasStartedAgainIsToldAgainOnce) {
  Running running({{"falcon", kFalcon}});
  ASSERT_TRUE(soon([&] { return running.news().size() == 1; }));
  avahi.come_back();
  ASSERT_TRUE(soon([&] { return running.news().size() == 2; }));
  EXPECT_EQ(names(), Names{"falcon"});
}

TEST_F(Announcing, ABusThatComesLateIsFound) {
  ::setenv("DBUS_SYSTEM_BUS_ADDRESS", ("unix:path=" + (folder.path() / "late").string()).c_str(), 1);
  Running running({{"falcon", kFalcon}});
  ASSERT_TRUE(soon([&] { return running.warnings().size() == 1; }));
  EXPECT_NE(running.warnings().front().find("there is no D-Bus system bus (No such file or directory)"),
            std::string::npos);
  FakeAvahi late(folder.path() / "late");
  EXPECT_TRUE(soon([&] { return late.announced().size() == 1; }));
}

TEST_F(Announcing, OneAddressIsToldByItsProtocolAndAllAddressesByBoth) {
  for (const auto& [listen, protocol] : {std::pair("[2001:db8::7]:5", 1), std::pair("[::]:5", -1)}) {  // no device
    ASSERT_TRUE(soon([&] { return avahi.announced().empty(); })) << "of the server before";
    Running running({{"falcon", kFalcon}}, listen);
    ASSERT_TRUE(soon([&] { return avahi.announced().size() == 1; }));
    EXPECT_EQ(avahi.announced().front().protocol, protocol);
    EXPECT_EQ(avahi.announced().front().interface, -1);
  }
}

TEST_F(Announcing, AServerOfThisMachineAloneIsNotAnnounced) {
  for (const std::string listen : {"127.0.0.1:47100", "[::1]:47100"}) {
    EXPECT_EQ(thrown_by<std::runtime_error>([&] {
                Running running({{"falcon", kFalcon}}, listen);
              }),
              "[discovery] announce: the server listens on " + listen +
                  ", which other machines cannot reach; expected [network] listen = \"0.0.0.0:47100\" or another "
                  "address of this machine, and keys");
  }
}

}  // namespace
}  // namespace tendon::announcer_test
