// SPDX-License-Identifier: Apache-2.0
#include "tests/server/guests/sealed_server.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "server/guests/unknown_keys.h"

namespace tendon::admission_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST_F(SealedServer, LetsAClientWithAKeyInFromAnywhereAndItsForcesArrive) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(seconds(1), {&a});
  EXPECT_EQ(phase(a), Phase::kOpen);
  EXPECT_EQ(loop_->stats().welcomed, 1U);
  EXPECT_GT(loop_->stats().forces, 500U);
  EXPECT_EQ(loop_->stats().dropped.forged, 0U);
}

TEST_F(SealedServer, IsSilentForAKeyItDoesNotHave) {
  Client a = controller(key_of("stranger", Role::kController, 99), "192.0.2.1:4000");
  run(seconds(5), {&a});
  EXPECT_NE(phase(a), Phase::kOpen);
  EXPECT_EQ(a.client->stats().sessions, 0U);
  EXPECT_GT(loop_->stats().hellos.unknown_key, 10U);
  const auto notices = loop_->take_notices();  // none were taken before
  ASSERT_EQ(notices.size(), 1U);
  EXPECT_EQ(notices[0].text, UnknownKeys::notice(parse_address("192.0.2.1:4000")));
  for (const Datagram& datagram : wire_) {
    EXPECT_TRUE(datagram.from != server_.self || datagram.bytes.size() == 48);  // Retries
  }
}

TEST_F(SealedServer, IsSilentForPlaintextFromAnotherMachine) {
  Client a = controller(std::nullopt, "192.0.2.1:4000");
  run(seconds(3), {&a});
  EXPECT_EQ(server_.sent, 0U);
  EXPECT_GT(loop_->stats().hellos.plain, 10U);
}

TEST_F(SealedServer, TellsAPlainClientOnThisMachineThatItWantsAKey) {
  Client a = controller(std::nullopt, "127.0.0.1:4000");
  run(milliseconds(50), {&a});
  EXPECT_EQ(phase(a), Phase::kRefused);
  EXPECT_EQ(a.client->stats().code, Code::kDenied);
  EXPECT_EQ(a.client->stats().reason, "this server only accepts clients with a key: use --key FILE");
}

TEST_F(SealedServer, SealsByAesWhereBothCanAndServesWhoCannot) {
  if (!crypto::has_aes()) GTEST_SKIP() << "this processor has no AES";
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(300), {&a});
  EXPECT_EQ(phase(a), Phase::kOpen);
  Client old = of_suites(other_, "192.0.2.2:4000", {Suite::kNoise}, true);
  Client screen = of_suites(screen_, "192.0.2.3:4000", {Suite::kNoise}, false);
  std::set<std::uint8_t> suites;  // of the datagrams in the session with the screen
  run(milliseconds(300), {&a, &old, &screen}, [&](const Datagram& datagram) {
    if (datagram.to == screen.end->self && (datagram.bytes[1] & std::byte{0x0F}) == std::byte{3}) {
      suites.insert(std::to_integer<std::uint8_t>(datagram.bytes[3]));
    }
    return true;
  });
  EXPECT_EQ(phase(screen), Phase::kOpen);
  EXPECT_EQ(suites, std::set<std::uint8_t>{1});
  EXPECT_EQ(old.client->stats().code, Code::kBusy);
  std::string said;
  for (const auto& [warning, text, session] : loop_->take_notices()) said += text + "\n";
  EXPECT_NE(said.find("with the key \"wall\", encrypted by aes-256-gcm\n"), std::string::npos) << said;
  EXPECT_NE(said.find("with the key \"screen\", encrypted by chacha20-poly1305\n"), std::string::npos) << said;
}

TEST_F(SealedServer, ASuiteThatItForbidsIsRefusedWithASentence) {
  if (!crypto::has_aes()) GTEST_SKIP() << "this processor has no AES";
  NetworkLoop::Config config;
  config.keys = {wall_, other_, screen_};
  config.suites = {Suite::kAesGcm};
  restart(config);
  Client old = of_suites(wall_, "192.0.2.1:4000", {Suite::kNoise}, true);
  run(milliseconds(300), {&old});
  EXPECT_EQ(phase(old), Phase::kRefused);
  EXPECT_EQ(old.client->stats().code, Code::kUnsupported);
  EXPECT_EQ(old.client->stats().reason, "no common cipher suite: this server only accepts aes-256-gcm");
  EXPECT_EQ(loop_->stats().welcomed, 0U);
  Client other = controller(other_, "192.0.2.2:4000");
  run(milliseconds(300), {&old, &other});
  EXPECT_EQ(phase(other), Phase::kOpen);

  config.suites = {Suite::kNoise};
  restart(config);
  Client only = of_suites(wall_, "192.0.2.4:4000", {Suite::kAesGcm}, true);
  run(milliseconds(300), {&only});
  EXPECT_EQ(phase(only), Phase::kRefused);
  EXPECT_EQ(only.client->stats().reason,
            "no common cipher suite: the server uses chacha20-poly1305, this client only accepts aes-256-gcm");
}

TEST_F(SealedServer, AnObserversKeyDoesNotControl) {
  Client a = controller(screen_, "192.0.2.1:4000");
  Client b = observer(screen_, "192.0.2.2:4000");
  run(milliseconds(50), {&a, &b});
  EXPECT_EQ(phase(a), Phase::kRefused);
  EXPECT_EQ(a.client->stats().code, Code::kDenied);
  EXPECT_EQ(phase(b), Phase::kOpen);
}

TEST_F(SealedServer, ASecondControllerIsRefusedAndSaysWhoControls) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(100), {&a});
  Client b = controller(other_, "192.0.2.2:4000");
  run(milliseconds(50), {&a, &b});
  EXPECT_EQ(phase(a), Phase::kOpen);
  EXPECT_EQ(phase(b), Phase::kRefused);
  EXPECT_NE(b.client->stats().reason.find("controlled by \"wall\""), std::string::npos);
}

TEST_F(SealedServer, TheSameKeyTakesItsPlaceAtOnceAndTheOneBeforeStaysAway) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(100), {&a});
  Client b = controller(wall_, "192.0.2.2:4000");
  run(milliseconds(100), {&a, &b});
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(phase(a), Phase::kStopped);
  EXPECT_EQ(a.client->stats().code, Code::kReplaced);
  EXPECT_EQ(loop_->stats().replaced, 1U);
  run(seconds(30), {&a, &b});
  EXPECT_EQ(b.client->stats().sessions, 1U);
}

TEST_F(SealedServer, AReplayedHelloTakesNothingFromAnybody) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(500), {&a});
  // The cookie is valid, because the address is the original one. The server has already dropped the Answer of this
  // attempt.
  Bytes hello;
  for (const Datagram& datagram : wire_) {
    if (datagram.to == server_.self && datagram.bytes.size() == kMaxDatagram) hello = datagram.bytes;
  }
  a.client->stop(now_);
  run(milliseconds(10), {&a});
  Client b = controller(other_, "192.0.2.2:4000");
  run(milliseconds(500), {&b});
  const auto before = loop_->stats();
  const std::uint64_t sessions = b.client->stats().sessions;
  for (int i = 0; i < 10; ++i) {
    deliver(a.end->self, hello);
    run(milliseconds(100), {&b});
  }
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(b.client->stats().sessions, sessions);
  EXPECT_EQ(loop_->stats().welcomed, before.welcomed);
  EXPECT_EQ(loop_->stats().replaced, 0U);
}

/// In suite 0, local programs and the network may replay an old Hello from its original address.
TEST_F(SealedServer, AReplayedPlainHelloTakesNothingFromWhoCameAfterIt) {
  restart({});
  Client a = controller(std::nullopt, "127.0.0.1:4000");
  run(milliseconds(500), {&a});
  Bytes hello;
  for (const Datagram& datagram : wire_) {
    if (datagram.to == server_.self && datagram.bytes.size() == kMaxDatagram) hello = datagram.bytes;
  }
  a.client->stop(now_);
  run(milliseconds(10), {&a});
  Client b = controller(std::nullopt, "127.0.0.1:4000");  // restarted at the same address
  run(milliseconds(500), {&b});
  const std::uint64_t welcomed = loop_->stats().welcomed;
  const std::uint64_t forces = loop_->stats().forces;
  for (int i = 0; i < 10; ++i) {
    deliver(a.end->self, hello);  // its cookie is valid for two minutes
    run(milliseconds(100), {&b});
  }
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(b.client->stats().sessions, 1U);
  EXPECT_EQ(loop_->stats().welcomed, welcomed);
  EXPECT_GT(loop_->stats().forces, forces + 950);
  b.client->stop(now_);
  run(milliseconds(10), {&b});
  deliver(a.end->self, hello);
  Client c = controller(std::nullopt, "127.0.0.1:4001");
  run(milliseconds(500), {&c});
  EXPECT_EQ(phase(c), Phase::kOpen);
}

TEST_F(SealedServer, DatagramsOfAGuestThatHasLeftAreNobodysAtOnce) {
  restart({});
  Client a = controller(std::nullopt, "127.0.0.1:4000");
  run(milliseconds(500), {&a});
  a.client->stop(now_);  // three Byes in one turn of the server
  run(milliseconds(2), {&a});
  EXPECT_EQ(loop_->stats().unknown_connection, 2U);
}

TEST_F(SealedServer, AControllersByeIsNoWarningAndItsSilenceIsOne) {
  restart({});
  const auto leavings = [&] {
    std::vector<bool> warnings;
    for (const auto& [warning, text, session] : loop_->take_notices()) {
      if (text.find("has left") != std::string::npos) warnings.push_back(warning);
    }
    return warnings;
  };
  Client polite = controller(std::nullopt, "127.0.0.1:4000");
  run(milliseconds(500), {&polite});
  polite.client->stop(now_);
  run(milliseconds(10), {&polite});
  EXPECT_EQ(leavings(), std::vector<bool>{false});
  Client silent = controller(std::nullopt, "127.0.0.1:4001");
  run(milliseconds(500), {&silent});
  ASSERT_EQ(phase(silent), Phase::kOpen);
  run(seconds(20), {});
  EXPECT_EQ(leavings(), std::vector<bool>{true});
}

TEST_F(SealedServer, AHalfOpenSessionIsToldNothingTakesNothingAndIsForgotten) {
  Client a = controller(wall_, "192.0.2.1:4000");
  const auto no_answers = [&](Datagram& d) { return d.from != server_.self || d.bytes.size() == 48; };
  run(milliseconds(300), {&a}, no_answers);
  EXPECT_EQ(loop_->stats().welcomed, 0U);
  std::set<std::size_t> sizes;
  for (const Datagram& d : wire_) {
    if (d.from == server_.self) sizes.insert(d.bytes.size());
  }
  EXPECT_EQ(sizes.size(), 2U);  // Retries and the repeated Answer: no other state
  Client b = controller(other_, "192.0.2.2:4000");
  run(milliseconds(100), {&b});
  EXPECT_EQ(phase(b), Phase::kOpen);
  run(seconds(6), {&b});
  EXPECT_EQ(loop_->stats().half_open_forgotten, 1U);
}

TEST_F(SealedServer, ManyHalfOpenSessionsDoNotKeepANewOneOut) {
  for (int i = 0; i < 100; ++i) {
    Client a = controller(wall_, "192.0.2." + std::to_string(1 + i % 50) + ":" + std::to_string(4000 + i));
    run(milliseconds(5), {&a}, [&](Datagram& d) { return d.from != server_.self || d.bytes.size() == 48; });
  }
  EXPECT_GE(loop_->stats().half_open_forgotten, 80U);
  Client b = controller(wall_, "192.0.2.200:4000");
  run(milliseconds(100), {&b});
  EXPECT_EQ(phase(b), Phase::kOpen);
}

TEST_F(SealedServer, FollowsAClientWhoseAddressChanges) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(seconds(1), {&a});
  a.end->self = parse_address("198.51.100.7:61000");
  const std::uint64_t states = a.client->stats().states;
  run(seconds(1), {&a});
  EXPECT_EQ(loop_->stats().roamed, 1U);
  EXPECT_EQ(a.client->stats().sessions, 1U);
  EXPECT_GT(a.client->stats().states, states + 900);
}

TEST_F(SealedServer, AReplayFromElsewhereDoesNotLeadItsAnswersAway) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(seconds(1), {&a});
  const Address thief = parse_address("203.0.113.9:9");
  const std::size_t heard = wire_.size();
  for (std::size_t i = 0; i < heard; ++i) {
    if (wire_[i].to == server_.self) deliver(thief, wire_[i].bytes);
  }
  run(seconds(1), {&a});
  EXPECT_EQ(loop_->stats().roamed, 0U);
  EXPECT_EQ(phase(a), Phase::kOpen);
  std::size_t to_thief = 0;
  for (std::size_t i = heard; i < wire_.size(); ++i) {
    if (wire_[i].to == thief) to_thief += wire_[i].bytes.size() > 48 ? 1U : 0U;
  }
  EXPECT_EQ(to_thief, 0U);
}

TEST_F(SealedServer, OneKeyCannotTakeAllObserversPlaces) {
  std::vector<Client> crowd;
  for (int i = 0; i < 8; ++i) crowd.push_back(observer(screen_, "192.0.2.1:" + std::to_string(4000 + i)));
  std::vector<Client*> all;
  for (Client& client : crowd) all.push_back(&client);
  run(milliseconds(100), all);
  EXPECT_EQ(std::count_if(crowd.begin(), crowd.end(), [](const Client& c) { return phase(c) == Phase::kOpen; }), 4);
  EXPECT_EQ(crowd.back().client->stats().code, Code::kBusy);
  EXPECT_EQ(crowd.back().client->stats().reason, "the key \"screen\" has 4 observers already");
  Client another = observer(other_, "192.0.2.9:4000");
  all.push_back(&another);
  run(milliseconds(100), all);
  EXPECT_EQ(phase(another), Phase::kOpen);
}

TEST_F(SealedServer, TheOnlyKeyHasAllObserversPlaces) {
  NetworkLoop::Config config;
  config.keys = {wall_};
  restart(config);
  std::vector<Client> crowd;
  for (int i = 0; i < 8; ++i) crowd.push_back(observer(wall_, "192.0.2.1:" + std::to_string(4000 + i)));
  std::vector<Client*> all;
  for (Client& client : crowd) all.push_back(&client);
  run(milliseconds(100), all);
  EXPECT_TRUE(std::all_of(crowd.begin(), crowd.end(), [](const Client& c) { return phase(c) == Phase::kOpen; }));
}

TEST_F(SealedServer, ASessionThatHasReachedItsAgeIsBegunAgainByItsClient) {
  NetworkLoop::Config config;
  config.keys = {wall_};
  config.rekey = {.datagrams = 500, .age = seconds(3)};
  config.session_life = seconds(20);
  restart(config);
  Client a = controller(wall_, "192.0.2.1:4000");
  run(seconds(50), {&a});
  EXPECT_EQ(phase(a), Phase::kOpen);
  EXPECT_EQ(a.client->stats().sessions, 3U);
  EXPECT_EQ(loop_->stats().timed_out, 0U);
  EXPECT_EQ(loop_->stats().dropped.forged + loop_->stats().dropped.old_key, 0U);
}

}  // namespace
}  // namespace tendon::admission_test
