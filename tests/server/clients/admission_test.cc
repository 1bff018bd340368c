// SPDX-License-Identifier: Apache-2.0
#include "tests/server/clients/sealed_server.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "server/clients/unknown_keys.h"

namespace tendon::admission_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

Bytes newest_hello(const Wire& wire) {
  const auto is_hello = [](const Datagram& datagram) { return datagram.bytes.size() == kMaxDatagram; };
  return std::find_if(wire.rbegin(), wire.rend(), is_hello)->bytes;
}

TEST_F(SealedServer, LetsAClientWithAKeyInFromAnywhereAndItsForcesArrive) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(seconds(1), {&a});
  EXPECT_EQ(phase(a), Phase::kOpen);
  EXPECT_EQ(stats().welcomed, 1U);
  EXPECT_GT(stats().forces, 500U);
  EXPECT_EQ(stats().dropped.forged, 0U);
}

TEST_F(SealedServer, IsSilentForAKeyItDoesNotHave) {
  Client a = controller(key_of("stranger", Role::kController, 99), "192.0.2.1:4000");
  run(seconds(5), {&a});
  EXPECT_NE(phase(a), Phase::kOpen);
  EXPECT_EQ(a->stats().sessions, 0U);
  EXPECT_GT(stats().hellos.unknown_key, 10U);
  EXPECT_EQ(take_notices(), std::vector{UnknownKeys::notice(parse_address("192.0.2.1:4000"))});
  for (const Datagram& datagram : wire_) {
    EXPECT_TRUE(datagram.from != server_ || datagram.bytes.size() == 48);  // Retries
  }
}

TEST_F(SealedServer, IsSilentForPlaintextFromAnotherMachine) {
  Client a = controller(std::nullopt, "192.0.2.1:4000");
  run(seconds(3), {&a});
  EXPECT_EQ(ends_[0].sent, 0U);
  EXPECT_GT(stats().hellos.plain, 10U);
}

TEST_F(SealedServer, TellsAPlainClientOnThisMachineThatItWantsAKey) {
  Client a = controller(std::nullopt, "127.0.0.1:4000");
  run(milliseconds(50), {&a});
  EXPECT_EQ(phase(a), Phase::kRefused);
  EXPECT_EQ(a->stats().code, Code::kDenied);
  EXPECT_EQ(a->stats().reason, "this server only accepts clients with a key: use --key FILE");
}

TEST_F(SealedServer, SealsByAesWhereBothCanAndServesWhoCannot) {
  if (!crypto::has_aes()) GTEST_SKIP() << "this processor has no AES";
  Client a = opened(wall_, "192.0.2.1:4000");
  EXPECT_EQ(phase(a), Phase::kOpen);
  Client old = controller(other_, "192.0.2.2:4000", {.suites = {Suite::kNoise}});
  Client screen = observer(screen_, "192.0.2.3:4000", {.suites = {Suite::kNoise}});
  std::set<std::uint8_t> suites;  // suites of the datagrams to and from the screen
  run(milliseconds(300), {&a, &old, &screen}, [&](const Datagram& datagram) {
    if (datagram.to == screen.end->self && (datagram.bytes[1] & std::byte{0x0F}) == std::byte{3}) {
      suites.insert(std::to_integer<std::uint8_t>(datagram.bytes[3]));
    }
    return true;
  });
  EXPECT_EQ(phase(screen), Phase::kOpen);
  EXPECT_EQ(suites, std::set<std::uint8_t>{1});
  EXPECT_EQ(old->stats().code, Code::kBusy);
  std::string said;
  for (const std::string& text : take_notices()) said += text + "\n";
  EXPECT_NE(said.find("with the key \"wall\", encrypted by aes-256-gcm\n"), std::string::npos) << said;
  EXPECT_NE(said.find("with the key \"screen\", encrypted by chacha20-poly1305\n"), std::string::npos) << said;
}

TEST_F(SealedServer, ASuiteThatItForbidsIsRefusedWithASentence) {
  if (!crypto::has_aes()) GTEST_SKIP() << "this processor has no AES";
  config_.suites = {Suite::kAesGcm};
  restart();
  Client old = opened(wall_, "192.0.2.1:4000", {.suites = {Suite::kNoise}});
  EXPECT_EQ(phase(old), Phase::kRefused);
  EXPECT_EQ(old->stats().code, Code::kUnsupported);
  EXPECT_EQ(old->stats().reason, "no common cipher suite: this server only accepts aes-256-gcm");
  EXPECT_EQ(stats().welcomed, 0U);
  Client other = controller(other_, "192.0.2.2:4000");
  run(milliseconds(300), {&old, &other});
  EXPECT_EQ(phase(other), Phase::kOpen);

  config_.suites = {Suite::kNoise};
  restart();
  Client only = opened(wall_, "192.0.2.4:4000", {.suites = {Suite::kAesGcm}});
  EXPECT_EQ(phase(only), Phase::kRefused);
  EXPECT_EQ(only->stats().reason,
            "no common cipher suite: the server uses chacha20-poly1305, this client only accepts aes-256-gcm");
}

TEST_F(SealedServer, AnObserversKeyDoesNotControl) {
  Client a = controller(screen_, "192.0.2.1:4000");
  Client b = observer(screen_, "192.0.2.2:4000");
  run(milliseconds(50), {&a, &b});
  EXPECT_EQ(phase(a), Phase::kRefused);
  EXPECT_EQ(a->stats().code, Code::kDenied);
  EXPECT_EQ(phase(b), Phase::kOpen);
}

TEST_F(SealedServer, ASecondControllerIsRefusedAndSaysWhoControls) {
  Client a = opened(wall_, "192.0.2.1:4000");
  Client b = controller(other_, "192.0.2.2:4000");
  run(milliseconds(50), {&a, &b});
  EXPECT_EQ(phase(a), Phase::kOpen);
  EXPECT_EQ(phase(b), Phase::kRefused);
  EXPECT_NE(b->stats().reason.find("controlled by \"wall\""), std::string::npos);
}

TEST_F(SealedServer, TheSameKeyTakesItsPlaceAtOnceAndTheOneBeforeStaysAway) {
  Client a = opened(wall_, "192.0.2.1:4000");
  Client b = controller(wall_, "192.0.2.2:4000");
  run(milliseconds(100), {&a, &b});
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(phase(a), Phase::kStopped);
  EXPECT_EQ(a->stats().code, Code::kReplaced);
  EXPECT_EQ(stats().replaced, 1U);
  run(seconds(30), {&a, &b});
  EXPECT_EQ(b->stats().sessions, 1U);
}

TEST_F(SealedServer, AReplayedHelloTakesNothingFromAnybody) {
  Client a = opened(wall_, "192.0.2.1:4000");
  // The address is the original one, so the cookie is valid. The server has dropped the Answer of this attempt.
  const Bytes hello = newest_hello(wire_);
  a->stop(now_);
  run(milliseconds(10), {&a});
  Client b = opened(other_, "192.0.2.2:4000");
  const auto before = stats();
  const std::uint64_t sessions = b->stats().sessions;
  for (int i = 0; i < 10; ++i) {
    deliver(a.end->self, hello);
    run(milliseconds(100), {&b});
  }
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(b->stats().sessions, sessions);
  EXPECT_EQ(stats().welcomed, before.welcomed);
  EXPECT_EQ(stats().replaced, 0U);
}

/// In suite 0, local programs and the network may replay an old Hello from its original address.
TEST_F(SealedServer, AReplayedPlainHelloTakesNothingFromWhoCameAfterIt) {
  restart_without_keys();
  Client a = opened(std::nullopt, "127.0.0.1:4000");
  const Bytes hello = newest_hello(wire_);
  a->stop(now_);
  run(milliseconds(10), {&a});
  Client b = controller(std::nullopt, "127.0.0.1:4000");  // restarted at the same address
  run(milliseconds(500), {&b});
  const std::uint64_t welcomed = stats().welcomed;
  const std::uint64_t forces = stats().forces;
  for (int i = 0; i < 10; ++i) {
    deliver(a.end->self, hello);  // its cookie is valid for two minutes
    run(milliseconds(100), {&b});
  }
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(b->stats().sessions, 1U);
  EXPECT_EQ(stats().welcomed, welcomed);
  EXPECT_GT(stats().forces, forces + 950);
  b->stop(now_);
  run(milliseconds(10), {&b});
  deliver(a.end->self, hello);
  Client c = opened(std::nullopt, "127.0.0.1:4001");
  EXPECT_EQ(phase(c), Phase::kOpen);
}

TEST_F(SealedServer, DatagramsOfAClientThatHasLeftAreNobodysAtOnce) {
  restart_without_keys();
  Client a = opened(std::nullopt, "127.0.0.1:4000");
  a->stop(now_);  // the server receives all three Byes in the same turn
  run(milliseconds(2), {&a});
  EXPECT_EQ(stats().unknown_connection, 2U);
}

TEST_F(SealedServer, AControllersByeIsNoWarningAndItsSilenceIsOne) {
  restart_without_keys();
  const auto leavings = [&] {
    std::vector<bool> warnings;
    for (const auto& [warning, text, session] : loop().take_notices()) {
      if (text.find("has left") != std::string::npos) warnings.push_back(warning);
    }
    return warnings;
  };
  Client polite = opened(std::nullopt, "127.0.0.1:4000");
  polite->stop(now_);
  run(milliseconds(10), {&polite});
  EXPECT_EQ(leavings(), std::vector<bool>{false});
  Client silent = opened(std::nullopt, "127.0.0.1:4001");
  ASSERT_EQ(phase(silent), Phase::kOpen);
  run(seconds(20), {});
  EXPECT_EQ(leavings(), std::vector<bool>{true});
}

TEST_F(SealedServer, AHalfOpenSessionIsToldNothingTakesNothingAndIsForgotten) {
  Client a = controller(wall_, "192.0.2.1:4000");
  const auto no_answers = [&](Datagram& d) { return d.from != server_ || d.bytes.size() == 48; };
  run(milliseconds(300), {&a}, no_answers);
  EXPECT_EQ(stats().welcomed, 0U);
  std::set<std::size_t> sizes;
  for (const Datagram& d : wire_) {
    if (d.from == server_) sizes.insert(d.bytes.size());
  }
  EXPECT_EQ(sizes.size(), 2U);  // Retries and the repeated Answer: no other state
  Client b = opened(other_, "192.0.2.2:4000");
  EXPECT_EQ(phase(b), Phase::kOpen);
  run(seconds(6), {&b});
  EXPECT_EQ(stats().half_open_forgotten, 1U);
}

TEST_F(SealedServer, ManyHalfOpenSessionsDoNotKeepANewOneOut) {
  for (int i = 0; i < 100; ++i) {
    Client a = controller(wall_, "192.0.2." + std::to_string(1 + i % 50) + ":" + std::to_string(4000 + i));
    run(milliseconds(5), {&a}, [&](Datagram& d) { return d.from != server_ || d.bytes.size() == 48; });
  }
  EXPECT_GE(stats().half_open_forgotten, 80U);
  Client b = opened(wall_, "192.0.2.200:4000");
  EXPECT_EQ(phase(b), Phase::kOpen);
}

TEST_F(SealedServer, FollowsAClientWhoseAddressChanges) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(seconds(1), {&a});
  a.end->self = parse_address("198.51.100.7:61000");
  const std::uint64_t states = a->stats().states;
  run(seconds(1), {&a});
  EXPECT_EQ(stats().roamed, 1U);
  EXPECT_EQ(a->stats().sessions, 1U);
  EXPECT_GT(a->stats().states, states + 900);
}

TEST_F(SealedServer, AReplayFromElsewhereDoesNotLeadItsAnswersAway) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(seconds(1), {&a});
  const Address thief = parse_address("203.0.113.9:9");
  const std::size_t heard = wire_.size();
  for (std::size_t i = 0; i < heard; ++i) {
    if (wire_[i].to == server_) deliver(thief, wire_[i].bytes);
  }
  run(seconds(1), {&a});
  EXPECT_EQ(stats().roamed, 0U);
  EXPECT_EQ(phase(a), Phase::kOpen);
  std::size_t to_thief = 0;
  for (std::size_t i = heard; i < wire_.size(); ++i) {
    if (wire_[i].to == thief) to_thief += wire_[i].bytes.size() > 48 ? 1U : 0U;
  }
  EXPECT_EQ(to_thief, 0U);
}

TEST_F(SealedServer, OneOfSeveralKeysHasHalfOfTheObserverSlots) {
  for (const bool only : {false, true}) {
    if (only) config_.keys = {screen_};
    restart();
    std::vector<Client> crowd;
    for (int i = 0; i < 8; ++i) crowd.push_back(observer(screen_, "192.0.2.1:" + std::to_string(4000 + i)));
    std::vector<Client*> all;
    for (Client& client : crowd) all.push_back(&client);
    run(milliseconds(100), all);
    EXPECT_EQ(std::ranges::count(crowd, Phase::kOpen, phase), only ? 8 : 4);
    if (only) break;
    EXPECT_EQ(crowd.back()->stats().code, Code::kBusy);
    EXPECT_EQ(crowd.back()->stats().reason, "the key \"screen\" has 4 observers already");
    Client another = observer(other_, "192.0.2.9:4000");
    all.push_back(&another);
    run(milliseconds(100), all);
    EXPECT_EQ(phase(another), Phase::kOpen);
  }
}

TEST_F(SealedServer, ASessionThatHasReachedItsAgeIsBegunAgainByItsClient) {
  config_.rekey = {.datagrams = 500, .age = seconds(3)};
  config_.session_life = seconds(20);
  restart();
  Client a = controller(wall_, "192.0.2.1:4000");
  run(seconds(50), {&a});
  EXPECT_EQ(phase(a), Phase::kOpen);
  EXPECT_EQ(a->stats().sessions, 3U);
  EXPECT_EQ(stats().timed_out, 0U);
  EXPECT_EQ(stats().dropped.forged + stats().dropped.old_key, 0U);
}

}  // namespace
}  // namespace tendon::admission_test
