// SPDX-License-Identifier: Apache-2.0
#include "server/network_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "tests/support/wire.h"

// The server's network half against real clients and forgers, on virtual time, over a perfect network.

namespace tendon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

ClientKey key_of(const std::string& name, Role role, std::uint64_t seed) {
  return {.name = name, .role = role, .key = Ratchet(seed).next()};
}

/// Z, the server, and whoever a test lets come.
class SealedServer : public testing::Test {
 protected:
  struct Client {
    std::unique_ptr<End> end;
    std::unique_ptr<ForceClient> client;
  };

  SealedServer() {
    NetworkLoop::Config config;
    config.keys = {wall_, other_, screen_};
    restart(config);
  }

  void restart(NetworkLoop::Config config) {
    config.secret.fill(std::byte{7});
    if (config.devices.empty()) {
      config.devices = {{.name = "left", .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}}};
    }
    std::vector<Mailboxes*> mail = {mail_.get()};
    if (config.devices.size() > 1) {
      second_ = std::make_unique<Mailboxes>(Mailboxes::Capacities{.datagrams = 1});
      mail.push_back(second_.get());
    }
    loop_ = std::make_unique<NetworkLoop>(config, server_, mail);
  }

  static ForceClient::Config config_of(const std::optional<ClientKey>& key, std::uint64_t seed) {
    ForceClient::Config config;
    config.name = key ? key->name : "plain";
    if (key) config.key = key->key;
    config.seed = seed;
    return config;
  }
  Client controller(const std::optional<ClientKey>& key, const std::string& address) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config_of(key, ++seed_), [](const DeviceState&) { return Touch(Vec3(1, 0, 0)); },
        now_);
    return client;
  }
  Client observer(const std::optional<ClientKey>& key, const std::string& address) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config_of(key, ++seed_), [](const DeviceState&, const LinkStats&) {}, now_);
    return client;
  }

  /// Time passes, 1 ms at a time; the device makes a step in each. `on_the_way` may change or drop.
  template <class OnTheWay>
  void run(Duration length, std::vector<Client*> clients, OnTheWay on_the_way) {
    for (const LocalTime end = now_ + length; now_ < end; now_ += milliseconds(1)) {
      DeviceState state;
      state.tick = tick_ += tick_step_;
      state.sampled = PeerTime(now_.time_since_epoch());
      state.force_wanted = wanted_;
      mail_->state.put(state);
      if (measured_) {
        ++health_.steps;
        ++health_.lateness[tick_ % 10];
        health_.at = now_;
        mail_->health.put(health_);
        if (second_) second_->health.put(health_);
      }
      if (second_) {
        state.device = 1;
        second_->state.put(state);
      }
      if (tick_ % steps_a_turn_ == 0) loop_->turn(now_);
      for (Client* client : clients) client->client->turn(now_);
      for (const std::size_t count = wire_.size(); count_ < count; ++count_) {
        Datagram datagram = wire_[count_];
        if (!on_the_way(datagram)) continue;
        if (datagram.to == server_.self) server_.inbox.push_back(datagram);
        for (Client* client : clients) {
          if (datagram.to == client->end->self) client->end->inbox.push_back(datagram);
        }
      }
    }
  }
  void run(Duration length, std::vector<Client*> clients) {
    run(length, std::move(clients), [](Datagram&) { return true; });
  }
  void deliver(const Address& from, const Bytes& bytes) { server_.inbox.push_back({from, server_.self, bytes}); }
  /// A controller of another make, in the clear, runs for `length`: it answers each state with what `spoil` makes of a
  /// good force, and does nothing at all while `sleeps` says so. Returns the newest report that it got.
  template <class Spoil, class Sleeps>
  std::optional<LinkReport> run_foreign(Duration length, Spoil spoil, Sleeps sleeps) {
    End end(wire_, parse_address("127.0.0.1:4000"));
    ClientHandshake handshake({.hello = {.role = Role::kController, .name = "foreign", .features = {}}}, now_);
    std::optional<Session> session;
    std::optional<LinkReport> report;
    std::uint64_t sequence = 0;
    std::array<std::byte, kMaxDatagram> buffer;
    const auto say = [&](auto& mine) {
      while (const std::size_t size = mine.next_datagram(now_, buffer)) {
        deliver(end.self, Bytes(buffer.begin(), buffer.begin() + static_cast<int>(size)));
      }
    };
    for (const LocalTime start = now_; now_ - start < length;) {
      const bool awake = !sleeps(now_ - start);
      if (awake) session ? say(*session) : say(handshake);
      run(milliseconds(1), {});
      count_ = 0;
      const Wire arrived = std::exchange(wire_, {});
      if (!awake) continue;  // and its socket overflows
      for (const Datagram& datagram : arrived) {
        session ? void(session->receive(now_, datagram.bytes)) : handshake.receive(now_, datagram.bytes);
      }
      if (!session && handshake.outcome()) {
        const auto& accepted = std::get<ClientHandshake::Accepted>(*handshake.outcome());
        session.emplace(Session::Config{.connection_id = accepted.connection_id}, now_);
      }
      while (const auto event = session ? session->next_event() : std::nullopt) {
        if (const auto* told = std::get_if<Session::ReportArrived>(&*event)) report = told->report;
        const auto* seen = std::get_if<Session::StateArrived>(&*event);
        if (seen == nullptr) continue;
        ForceCommand force;
        force.sequence = ++sequence;
        force.based_on_tick = seen->state.tick;
        force.force = Vec3(1, 0, 0);
        force.valid_for = milliseconds(20);
        spoil(force);
        session->send(force);
      }
    }
    return report;
  }
  template <class Spoil>
  std::optional<LinkReport> run_foreign(Duration length, Spoil spoil) {
    return run_foreign(length, spoil, [](Duration) { return false; });
  }
  /// An observer that asks for all there is; `seen` is the newest state that it saw, if it matters.
  Client diagnosing(const std::optional<ClientKey>& key, const std::string& address, const std::string& device = {},
                    DeviceState* seen = nullptr) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    ForceClient::Config config = config_of(key, ++seed_);
    config.diagnostics = true;
    config.device = device;
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config,
        [seen](const DeviceState& state, const LinkStats&) {
          if (seen != nullptr) *seen = state;
        },
        now_);
    return client;
  }
  static ForceClient::Phase phase(const Client& client) { return client.client->phase(); }

  ClientKey wall_ = key_of("wall", Role::kController, 1);
  ClientKey other_ = key_of("other", Role::kController, 2);
  ClientKey screen_ = key_of("screen", Role::kObserver, 3);
  LocalTime now_{seconds(1000)};
  Wire wire_;
  std::size_t count_ = 0;  ///< of the wire, delivered
  End server_{wire_, parse_address("192.0.2.100:47100")};
  std::unique_ptr<Mailboxes> mail_ = std::make_unique<Mailboxes>();
  std::unique_ptr<Mailboxes> second_;  ///< of a second device
  std::unique_ptr<NetworkLoop> loop_;
  std::uint64_t tick_ = 0;
  std::uint64_t tick_step_ = 1;
  std::uint64_t steps_a_turn_ = 1;  ///< more: the network thread is late, and sees only the newest of them
  std::optional<Vec3> wanted_;      ///< as the device's loop says
  bool measured_ = false;           ///< the log thread tells how the loops do
  Health health_;
  std::uint64_t seed_ = 10;
};

using Phase = ForceClient::Phase;

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
  EXPECT_EQ(a.client->stats().reason, "this server lets in those who have a key: --key FILE");
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
  // From its own address, where its cookie is good, and after the server has forgotten this attempt's Answer.
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

/// In suite 0 anybody on this machine may say an old Hello again, and the network may, from where it came.
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
  Client b = controller(std::nullopt, "127.0.0.1:4000");  // begun again, at the same address
  run(milliseconds(500), {&b});
  const std::uint64_t welcomed = loop_->stats().welcomed;
  const std::uint64_t forces = loop_->stats().forces;
  for (int i = 0; i < 10; ++i) {
    deliver(a.end->self, hello);  // its cookie is good for two minutes
    run(milliseconds(100), {&b});
  }
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(b.client->stats().sessions, 1U);
  EXPECT_EQ(loop_->stats().welcomed, welcomed);
  EXPECT_GT(loop_->stats().forces, forces + 950);
  // Nor does it keep the device from anybody once b has gone.
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
  a.client->stop(now_);  // three Byes, in one turn of the server
  run(milliseconds(2), {&a});
  EXPECT_EQ(loop_->stats().unknown_connection, 2U);
}

TEST_F(SealedServer, AHalfOpenSessionIsToldNothingTakesNothingAndIsForgotten) {
  Client a = controller(wall_, "192.0.2.1:4000");
  // The Answer never arrives.
  const auto no_answers = [&](Datagram& d) { return d.from != server_.self || d.bytes.size() == 48; };
  run(milliseconds(300), {&a}, no_answers);
  EXPECT_EQ(loop_->stats().welcomed, 0U);
  std::set<std::size_t> sizes;
  for (const Datagram& d : wire_) {
    if (d.from == server_.self) sizes.insert(d.bytes.size());
  }
  EXPECT_EQ(sizes.size(), 2U);  // Retries, and one Answer again and again: no state
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

/// A server with a device "left" of one channel, and a device "right" of two, the second of which has a lease.
class TwoDevices : public SealedServer {
 protected:
  TwoDevices() {
    NetworkLoop::Config config;
    config.keys = {wall_, other_, screen_};
    config.takeover = {"other"};
    config.devices = {
        {.name = "left", .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}},
        {.name = "right",
         .model = "device",
         .loop_hz = 1000,
         .channels = {{.name = "guidance"},
                      {.name = "tissue", .rule = ChannelRule::kPriority, .lease = milliseconds(500), .holder = {}}}}};
    restart(config);
  }

  Client controller_of(const ClientKey& key, const std::string& address, const std::string& device,
                       const std::string& channel, bool take_lease = false) {
    Client client{std::make_unique<End>(wire_, parse_address(address)), nullptr};
    ForceClient::Config config = config_of(key, ++seed_);
    config.device = device;
    config.channel = channel;
    config.take_lease = take_lease;
    client.client = std::make_unique<ForceClient>(
        *client.end, server_.self, config, [](const DeviceState&) { return Touch(Vec3(1, 0, 0)); }, now_);
    return client;
  }
  NetworkLoop::Stats::Channel tissue() const { return loop_->stats().channels.at(2); }
};

TEST_F(TwoDevices, GivesEachEngineItsDeviceAndItsChannel) {
  Client left = controller(wall_, "192.0.2.1:4000");  // knows of nothing but "the device"
  Client right = controller_of(other_, "192.0.2.2:4000", "right", "guidance");
  run(seconds(1), {&left, &right});
  const auto channels = loop_->stats().channels;
  ASSERT_EQ(channels.size(), 3U);
  EXPECT_GT(channels[0].forces, 500U);
  EXPECT_GT(channels[1].forces, 500U);
  EXPECT_EQ(channels[2].forces, 0U);
  EXPECT_EQ(channels[0].holder, "wall");
  EXPECT_EQ(channels[1].holder, "other");
  EXPECT_EQ(loop_->stats().denied, 0U);
  EXPECT_NE(mail_->forces[0].take(), nullptr);
  EXPECT_NE(second_->forces[0].take(), nullptr);
  EXPECT_EQ(second_->forces[1].take(), nullptr);
  ASSERT_TRUE(right.client->description().has_value());
  EXPECT_EQ(right.client->description()->name, "right");
  EXPECT_EQ(right.client->description()->channels.at(0).holder, "other");
}

TEST_F(TwoDevices, RefusesWhatIsNotThereAndSaysWhatIs) {
  Client a = controller_of(wall_, "192.0.2.1:4000", "middle", "");
  run(milliseconds(50), {&a});
  EXPECT_EQ(a.client->stats().code, Code::kInvalid);
  EXPECT_EQ(a.client->stats().reason, "there is no device \"middle\", only \"left\", \"right\"");
  Client b = controller_of(wall_, "192.0.2.2:4000", "right", "bone");
  run(milliseconds(50), {&b});
  EXPECT_EQ(b.client->stats().reason, "there is no channel \"bone\", only \"guidance\", \"tissue\"");
}

TEST_F(TwoDevices, ALeaseIsTakenFromAHolderThatHasFallenSilentAndNotBefore) {
  Client first = controller_of(other_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  EXPECT_TRUE(first.client->holds());
  Client second = controller_of(wall_, "192.0.2.2:4000", "right", "tissue", true);
  run(seconds(2), {&first, &second});
  EXPECT_FALSE(second.client->holds());
  EXPECT_EQ(phase(second), Phase::kOpen);
  EXPECT_EQ(second.client->stats().forces, 0U);
  EXPECT_EQ(tissue().holder, "other");

  const LocalTime silent = now_;  // its session lives on for 2 s, but nothing comes from it
  run(milliseconds(400), {&second});
  EXPECT_EQ(tissue().holder, "other");
  while (!second.client->holds() && now_ - silent < seconds(1)) run(milliseconds(10), {&second});
  EXPECT_TRUE(second.client->holds());
  EXPECT_GE(now_ - silent, milliseconds(500));
  EXPECT_EQ(tissue().handovers, 1U);
  run(milliseconds(300), {&first, &second});
  EXPECT_FALSE(first.client->holds()) << "it was told that it has lost the lease";
  EXPECT_EQ(first.client->stats().lease_lost_to, "wall");
  EXPECT_EQ(phase(first), Phase::kOpen);
  EXPECT_EQ(tissue().holder, "wall");
}

TEST_F(TwoDevices, ForcesThatTheHandNeverFeelsDoNotRenewALease) {
  Client first = controller_of(other_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  Client second = controller_of(wall_, "192.0.2.2:4000", "right", "tissue", true);
  run(seconds(2), {&first, &second});
  ASSERT_TRUE(first.client->holds());
  tick_step_ = 4096;  // each state takes the place of the one before, so that every force answers a forgotten one
  const std::uint64_t forces = first.client->stats().forces;
  run(seconds(1), {&first, &second});
  EXPECT_GT(first.client->stats().forces, forces + 400);
  EXPECT_GT(loop_->stats().unanswerable, 400U);
  EXPECT_TRUE(second.client->holds());
}

TEST_F(TwoDevices, WhoMayTakeOverNeedNotWait) {
  Client first = controller_of(wall_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  Client second = controller_of(other_, "192.0.2.2:4000", "right", "tissue", true);
  run(milliseconds(100), {&first, &second});
  EXPECT_TRUE(second.client->holds());
  EXPECT_FALSE(first.client->holds());
  const std::uint64_t forces = first.client->stats().forces;
  run(milliseconds(300), {&first, &second});
  EXPECT_EQ(first.client->stats().forces, forces) << "the loser sends no more";
  EXPECT_GT(loop_->stats().denied, 0U) << "and what it sent before it knew was not taken";
  EXPECT_EQ(tissue().handovers, 1U);
}

TEST_F(TwoDevices, AGivenLeaseIsFree) {
  Client first = controller_of(wall_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  EXPECT_TRUE(first.client->give_lease());
  run(milliseconds(50), {&first});
  EXPECT_FALSE(first.client->holds());
  EXPECT_EQ(tissue().holder, "");
  EXPECT_TRUE(first.client->take_lease());
  run(milliseconds(50), {&first});
  EXPECT_TRUE(first.client->holds());
}

TEST_F(TwoDevices, ALeaseGivenBackBeforeItsAnswerCameIsNotHeld) {
  Client first = controller_of(wall_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  EXPECT_TRUE(first.client->give_lease());
  run(milliseconds(50), {&first});
  EXPECT_TRUE(first.client->take_lease());
  EXPECT_TRUE(first.client->give_lease());
  run(milliseconds(50), {&first});
  EXPECT_EQ(tissue().holder, "");
  EXPECT_FALSE(first.client->holds()) << "what was asked before is answered after";
}

TEST_F(TwoDevices, AControllerArmsAndDisarmsWhileAnotherHoldsTheLease) {
  Client holder = controller_of(wall_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&holder});
  Client second = controller_of(other_, "192.0.2.2:4000", "right", "tissue");
  run(milliseconds(100), {&holder, &second});
  ASSERT_FALSE(second.client->holds());
  const auto orders = [](Mailboxes& mail) {
    std::vector<HapticOrder::Kind> kinds;
    for (; mail.orders.front() != nullptr; mail.orders.pop()) kinds.push_back(mail.orders.front()->kind);
    return kinds;
  };
  orders(*second_);
  loop_->take_notices();
  ASSERT_TRUE(second.client->disarm());
  ASSERT_TRUE(second.client->rearm());
  run(milliseconds(100), {&holder, &second});
  EXPECT_EQ(orders(*second_), (std::vector{HapticOrder::Kind::kDisarm, HapticOrder::Kind::kRearm}));
  EXPECT_TRUE(orders(*mail_).empty()) << "the device of another";
  std::vector<std::string> said;
  for (const auto& notice : loop_->take_notices()) said.push_back(notice.text);
  EXPECT_EQ(said, (std::vector<std::string>{"disarmed by \"other\"", "rearmed by \"other\""}));
  EXPECT_TRUE(holder.client->holds());
}

TEST_F(TwoDevices, WhoCannotBeDisarmedAtOnceIsToldToAskAgain) {
  Client a = controller_of(wall_, "192.0.2.1:4000", "right", "guidance");
  run(milliseconds(300), {&a});
  while (second_->orders.try_push({HapticOrder::Kind::kRelease})) {
  }
  loop_->take_notices();
  ASSERT_TRUE(a.client->disarm());
  run(milliseconds(100), {&a});
  EXPECT_TRUE(loop_->take_notices().empty()) << "what was not done is not told";
  ASSERT_TRUE(a.client->order_answer().has_value());
  EXPECT_EQ(a.client->order_answer()->code, Code::kBusy);
}

TEST_F(SealedServer, AnObserverMayNotDisarm) {
  Client a = observer(screen_, "192.0.2.1:4000");
  run(milliseconds(300), {&a});
  ASSERT_TRUE(a.client->disarm());
  run(milliseconds(100), {&a});
  EXPECT_EQ(loop_->stats().denied, 1U);
  EXPECT_EQ(mail_->orders.front(), nullptr);
}

TEST_F(TwoDevices, AChannelWithoutALeaseIsNotTakenFromItsHolder) {
  Client first = controller_of(wall_, "192.0.2.1:4000", "right", "guidance");
  run(milliseconds(300), {&first});
  Client second = controller_of(other_, "192.0.2.2:4000", "right", "guidance", true);
  run(milliseconds(100), {&first, &second});
  EXPECT_EQ(second.client->stats().code, Code::kBusy);
  EXPECT_TRUE(first.client->holds());
}

TEST_F(SealedServer, TellsControllersAloneOnceASecondHowTheirForcesFare) {
  Client a = controller(wall_, "192.0.2.1:4000");
  Client b = observer(screen_, "192.0.2.2:4000");
  run(milliseconds(3500), {&a, &b});
  ASSERT_TRUE(a.client->report().has_value());
  const LinkReport& report = *a.client->report();
  EXPECT_EQ(report.number, 3U);
  EXPECT_EQ(report.span, seconds(1));
  EXPECT_GT(report.forces, 900U);
  EXPECT_EQ(report.late_server + report.late_network + report.late_engine, 0U);
  EXPECT_EQ(report.words, "");
  EXPECT_EQ(report.lost, 0U);
  EXPECT_GT(report.received, 2900U);
  ASSERT_TRUE(report.round_trip && report.to_server && report.to_client);
  EXPECT_LE(report.round_trip->p99, milliseconds(2));
  // Both ways and the clocks: one time here, so the offset is within its bound of 0.
  EXPECT_LE(std::chrono::abs(report.clock_offset), report.clock_error);
  EXPECT_LE(std::chrono::abs(report.to_server->median + report.to_client->median - report.round_trip->median),
            milliseconds(1));
  EXPECT_FALSE(b.client->report().has_value());
}

/// 20 ms each way, and one of the two ends loses its processor for 36 ms, once, in the middle of a turn: what has come
/// meanwhile it takes by the time at which the turn began.
class InterruptedTurn : public SealedServer, public testing::WithParamInterface<bool> {};

TEST_P(InterruptedTurn, MakesNoWayLookShort) {
  const bool of_server = GetParam();
  Client a = controller(wall_, "192.0.2.1:4000");
  std::deque<std::pair<LocalTime, Datagram>> under_way;
  const LocalTime begins = now_ + milliseconds(2000);
  const LocalTime goes_on = begins + milliseconds(36);
  for (const LocalTime end = now_ + milliseconds(5500); now_ < end; now_ += milliseconds(1)) {
    DeviceState state;
    state.tick = ++tick_;
    state.sampled = PeerTime(now_.time_since_epoch());
    mail_->state.put(state);
    for (; !under_way.empty() && under_way.front().first <= now_; under_way.pop_front()) {
      const Datagram& datagram = under_way.front().second;
      (datagram.to == server_.self ? server_ : *a.end).inbox.push_back(datagram);
    }
    const bool interrupted = now_ >= begins && now_ < goes_on;
    const LocalTime told = now_ == goes_on ? begins : now_;
    End& end_of_it = of_server ? server_ : *a.end;
    end_of_it.taken = now_;
    if (!(interrupted && of_server)) loop_->turn(of_server ? told : now_);
    if (!(interrupted && !of_server)) a.client->turn(of_server ? now_ : told);
    for (; count_ < wire_.size(); ++count_) under_way.emplace_back(now_ + milliseconds(20), wire_[count_]);
  }
  ASSERT_TRUE(a.client->report() && a.client->report()->to_server && a.client->report()->to_client);
  for (const auto& way : {a.client->report()->to_server, a.client->report()->to_client}) {
    EXPECT_GE(way->median, milliseconds(18));
    EXPECT_LE(way->median, milliseconds(22));
  }
}

INSTANTIATE_TEST_SUITE_P(OfTheServerAndOfTheClient, InterruptedTurn, testing::Bool());

TEST_F(SealedServer, SaysByNumbersAndInWordsThatTheNetworkWasLate) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(1500), {&a});
  run(milliseconds(60), {&a}, [](Datagram&) { return false; });
  run(milliseconds(600), {&a});
  ASSERT_TRUE(a.client->report().has_value());
  const LinkReport& report = *a.client->report();
  EXPECT_EQ(report.number, 2U);
  EXPECT_GT(report.longest_gap, milliseconds(55));
  EXPECT_GE(report.lost, 1U);
  EXPECT_EQ(report.late_network, 1U);
  EXPECT_EQ(report.late_engine + report.late_server, 0U);
  EXPECT_NEAR(tendon::seconds(report.worst_late), 40e-3, 4e-3);  // valid for 20 ms
  EXPECT_NE(report.words.find("the network (datagrams were lost)"), std::string::npos) << report.words;
  EXPECT_EQ(loop_->stats().late_network, 1U);
  const auto notices = loop_->take_notices();
  EXPECT_TRUE(std::any_of(notices.begin(), notices.end(), [&](const auto& n) { return n.text == report.words; }));
}

struct BadForces {
  const char* name;
  void (*spoil)(ForceCommand&);
  std::uint64_t RefusedForces::*count;
  const char* words;
};
void PrintTo(const BadForces& bad, std::ostream* out) { *out << bad.name; }
class BadForcesTest : public SealedServer, public testing::WithParamInterface<BadForces> {};

TEST_P(BadForcesTest, TheirAuthorIsToldWhatIsWrongWithThem) {
  restart({});
  const auto report = run_foreign(milliseconds(2500), GetParam().spoil);
  ASSERT_TRUE(report.has_value());
  EXPECT_NE(report->words.find(GetParam().words), std::string::npos) << report->words;
  EXPECT_GT(report->refused.*GetParam().count, 900U);
  EXPECT_EQ(report->late_network + report->late_server + report->late_unknown, 0U);
  const auto notices = loop_->take_notices();
  EXPECT_TRUE(std::any_of(notices.begin(), notices.end(), [&](const auto& n) { return n.text == report->words; }));
}

TEST_P(BadForcesTest, ThatFollowGoodOnesAreNamedAsTheCauseOfLateness) {
  restart({});
  const LocalTime turns_bad = now_ + milliseconds(1500);
  const auto report = run_foreign(milliseconds(2500), [&](ForceCommand& force) {
    if (now_ > turns_bad) GetParam().spoil(force);
  });
  ASSERT_TRUE(report.has_value());
  EXPECT_EQ(report->words.find("forces were late once, by up to "), 0U) << report->words;
  EXPECT_NE(report->words.find(GetParam().words), std::string::npos) << report->words;
  EXPECT_EQ(report->late_engine, 1U);
}

INSTANTIATE_TEST_SUITE_P(
    Of, BadForcesTest,
    testing::Values(BadForces{"NotFinite", [](ForceCommand& f) { f.force.y() = NAN; }, &RefusedForces::not_finite,
                              "the engine (its forces are not finite: NaN or infinity)"},
                    BadForces{"NotFiniteModel",
                              [](ForceCommand& f) { f.model = LocalModel{.stiffness = Mat3::Constant(-INFINITY)}; },
                              &RefusedForces::not_finite, "the engine (its forces are not finite: NaN or infinity)"},
                    BadForces{"OutOfBounds", [](ForceCommand& f) { f.force.x() = 2e12; }, &RefusedForces::out_of_bounds,
                              "the engine (its forces are out of the bounds of WIRE.md)"},
                    BadForces{"NeverValid", [](ForceCommand& f) { f.valid_for = {}; }, &RefusedForces::out_of_bounds,
                              "the engine (its forces are out of the bounds of WIRE.md)"},
                    BadForces{"UnknownTick", [](ForceCommand& f) { f.based_on_tick += 100'000; },
                              &RefusedForces::unknown_tick,
                              "the engine (its forces answer unknown or forgotten ticks)"},
                    BadForces{"OldSequence", [](ForceCommand& f) { f.sequence = 1; }, &RefusedForces::old_sequence,
                              "the engine (its sequence numbers do not grow)"}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_F(SealedServer, AnEngineOnThisMachineThatSleepsIsBlamedWhileItSleeps) {
  restart({});
  const auto sleeps = [](Duration t) { return t > milliseconds(1500) && t < milliseconds(3200); };
  run_foreign(
      milliseconds(3100), [](ForceCommand&) {}, sleeps);
  EXPECT_EQ(loop_->stats().late_engine, 2U);
  EXPECT_EQ(loop_->stats().late_network + loop_->stats().late_unknown + loop_->stats().late_ours, 0U);
}

TEST_F(SealedServer, AnEngineThatSleptIsBlamedThoughItsRoundTripLooksLong) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(1200), {&a});
  const std::size_t asleep = wire_.size();
  run(milliseconds(700), {});
  // Its socket has kept the oldest datagrams; the newest ones found it full.
  for (std::size_t i = asleep; i < asleep + 300; ++i) a.end->inbox.push_back(wire_[i]);
  run(milliseconds(900), {&a});
  ASSERT_TRUE(a.client->report().has_value());
  EXPECT_NE(a.client->report()->words.find("the engine (its program stood still for 7"), std::string::npos)
      << a.client->report()->words;
  EXPECT_EQ(loop_->stats().late_network, 0U);
}

TEST_F(SealedServer, NobodyIsBlamedForTheSilenceOfARemoteEngineBeforeItIsHeard) {
  Client a = controller(wall_, "192.0.2.1:4000");
  run(milliseconds(1500), {&a});
  run(milliseconds(1000), {});
  EXPECT_EQ(loop_->stats().late_unknown, 1U);
  EXPECT_EQ(loop_->stats().late_network + loop_->stats().late_engine, 0U);
}

TEST_F(SealedServer, AControllerThatHasSentNoForceIsToldNothingAboutItsForces) {
  Client a{std::make_unique<End>(wire_, parse_address("192.0.2.1:4000")), nullptr};
  a.client = std::make_unique<ForceClient>(
      *a.end, server_.self, config_of(wall_, 5), [](const DeviceState&) { return Touch(Vec3::Constant(NAN)); }, now_);
  run(seconds(3), {&a});
  EXPECT_EQ(phase(a), Phase::kOpen);
  EXPECT_FALSE(a.client->report().has_value());
}

std::uint64_t sum(const LatenessHistogram& lateness) {
  return std::accumulate(lateness.begin(), lateness.end(), std::uint64_t{0});
}

TEST_F(SealedServer, TellsAnObserverThatAsksHowTheLoopAndTheEngineDo) {
  Client a = controller(wall_, "192.0.2.1:4000");
  DeviceState seen;
  Client b = diagnosing(screen_, "192.0.2.2:4000", {}, &seen);
  wanted_ = Vec3(3, 0, -4);
  measured_ = true;
  health_.steps = health_.lateness[2] = 1'000'000;  // since long before
  health_.safety = Safety::kArmed;
  run(milliseconds(1500), {&a, &b});
  ASSERT_TRUE(b.client->device_report().has_value());
  EXPECT_EQ(b.client->device_report()->number, 1U);
  health_.safety = Safety::kFault;
  health_.fault = "the handle was faster than a hand";
  health_.missed = 7;
  health_.overruns = 2;
  health_.unseen = 3;
  health_.recording_ended = true;
  run(milliseconds(1000), {&a, &b});

  ASSERT_TRUE(seen.force_wanted.has_value());
  EXPECT_EQ(*seen.force_wanted, Vec3(3, 0, -4));
  const DeviceReport& report = *b.client->device_report();
  EXPECT_EQ(report.number, 2U);
  EXPECT_EQ(report.span, seconds(1));
  EXPECT_EQ(report.steps, 1000U);
  EXPECT_EQ(sum(report.lateness), report.steps);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_EQ(report.lateness[i], 100U) << i;
  EXPECT_EQ(report.missed, 7U);
  EXPECT_EQ(report.overruns, 2U);
  EXPECT_EQ(report.unseen, 3U);
  EXPECT_EQ(report.safety, Safety::kFault);
  EXPECT_EQ(report.fault, "the handle was faster than a hand");
  EXPECT_EQ(report.degraded, "recording has stopped");

  ASSERT_EQ(b.client->peer_reports().size(), 1U);
  const PeerReport& peer = b.client->peer_reports().front();
  EXPECT_EQ(peer.name, "wall");
  EXPECT_EQ(peer.state_one_in, 1U);
  EXPECT_FALSE(peer.forces_refused);
  // What the engine itself is told.
  ASSERT_TRUE(a.client->report().has_value());
  const LinkReport& own = *a.client->report();
  EXPECT_EQ(peer.link.until, own.until);
  EXPECT_EQ(peer.link.forces, own.forces);
  EXPECT_EQ(peer.link.received, own.received);
  ASSERT_TRUE(peer.link.round_trip.has_value());
  EXPECT_EQ(peer.link.round_trip->median, own.round_trip->median);
  EXPECT_EQ(peer.link.words, own.words);
}

TEST_F(SealedServer, AnObserverSeesWhatAnEnginesLinkHasLostAndForHowLong) {
  Client a = controller(wall_, "192.0.2.1:4000");
  Client b = diagnosing(screen_, "192.0.2.2:4000");
  run(milliseconds(1500), {&a, &b});
  run(milliseconds(60), {&a, &b}, [&](Datagram& d) { return d.from != a.end->self && d.to != a.end->self; });
  run(milliseconds(600), {&a, &b});
  ASSERT_EQ(b.client->peer_reports().size(), 1U);
  const LinkReport& link = b.client->peer_reports().front().link;
  EXPECT_GE(link.lost, 1U);
  EXPECT_GT(link.longest_gap, milliseconds(55));
  EXPECT_EQ(link.late_network, 1U);
  EXPECT_NE(link.words.find("the network (datagrams were lost)"), std::string::npos) << link.words;
  EXPECT_EQ(b.client->stats().link.invalid, 0U);
}

TEST_F(SealedServer, AnObserverIsToldOfAnEngineThatSendsNoForceToo) {
  Client a{std::make_unique<End>(wire_, parse_address("192.0.2.1:4000")), nullptr};
  a.client = std::make_unique<ForceClient>(
      *a.end, server_.self, config_of(wall_, 5), [](const DeviceState&) { return Touch(Vec3::Constant(NAN)); }, now_);
  Client b = diagnosing(screen_, "192.0.2.2:4000");
  run(milliseconds(2500), {&a, &b});
  ASSERT_EQ(b.client->peer_reports().size(), 1U);
  const LinkReport& link = b.client->peer_reports().front().link;
  EXPECT_EQ(link.number, 2U);
  EXPECT_EQ(link.forces, 0U);
  EXPECT_GT(link.received, 0U);
  EXPECT_TRUE(link.round_trip.has_value());
}

TEST_F(SealedServer, WhatAnObserverWasToldGoesWithItsSession) {
  Client a = controller(wall_, "192.0.2.1:4000");
  Client b = diagnosing(screen_, "192.0.2.2:4000");
  measured_ = true;
  run(milliseconds(2500), {&a, &b});
  EXPECT_TRUE(b.client->device_report().has_value());
  EXPECT_FALSE(b.client->peer_reports().empty());
  loop_->close(now_);
  measured_ = false;
  run(milliseconds(500), {&b});
  EXPECT_EQ(phase(b), Phase::kOpen);
  EXPECT_EQ(b.client->stats().sessions, 2U);
  EXPECT_FALSE(b.client->device_report().has_value());
  EXPECT_TRUE(b.client->peer_reports().empty());
}

TEST_F(SealedServer, WhoDoesNotAskIsToldNothingOfIt) {
  Client a = controller(wall_, "192.0.2.1:4000");
  DeviceState seen;
  Client b{std::make_unique<End>(wire_, parse_address("192.0.2.2:4000")), nullptr};
  b.client = std::make_unique<ForceClient>(
      *b.end, server_.self, config_of(screen_, 5), [&](const DeviceState& state, const LinkStats&) { seen = state; },
      now_);
  Client c = diagnosing(screen_, "192.0.2.3:4000");
  wanted_ = Vec3(3, 0, -4);
  measured_ = true;
  run(milliseconds(2500), {&a, &b, &c});
  EXPECT_GT(seen.tick, 2000U);
  EXPECT_FALSE(seen.force_wanted.has_value());
  EXPECT_FALSE(b.client->device_report().has_value());
  EXPECT_TRUE(b.client->peer_reports().empty());
  EXPECT_TRUE(c.client->device_report().has_value());
  EXPECT_TRUE(c.client->peer_reports().size() == 1);
  EXPECT_FALSE(a.client->device_report().has_value());
}

TEST_F(SealedServer, AnEngineReceivesNotOneByteMoreWhereOthersDiagnose) {
  const auto to_engine = [&](bool others_diagnose) {
    wire_.clear();
    count_ = 0;
    now_ = LocalTime(seconds(1000));
    tick_ = 0;
    seed_ = 10;
    health_ = {};
    mail_ = std::make_unique<Mailboxes>();
    NetworkLoop::Config config;
    restart(config);
    wanted_ = others_diagnose ? std::optional(Vec3(3, 0, -4)) : std::nullopt;
    measured_ = others_diagnose;
    Client a = controller({}, "127.0.0.1:4000");
    run(milliseconds(100), {&a});
    Client b = others_diagnose ? diagnosing({}, "127.0.0.1:5000") : observer({}, "127.0.0.1:5000");
    run(milliseconds(2500), {&a, &b});
    EXPECT_EQ(phase(a), Phase::kOpen);
    EXPECT_EQ(b.client->device_report().has_value(), others_diagnose);
    std::vector<Bytes> datagrams;
    for (const Datagram& datagram : wire_) {
      if (datagram.to == a.end->self) datagrams.push_back(datagram.bytes);
    }
    return datagrams;
  };
  const auto before = to_engine(false);
  EXPECT_GT(before.size(), 2500U);
  EXPECT_TRUE(to_engine(true) == before);
}

/// What a controller gets that offers the feature all the same, which ours refuses to.
TEST_F(SealedServer, AControllerIsNotGrantedTheFeatureAndIsToldNothingOfIt) {
  NetworkLoop::Config server;
  restart(server);
  wanted_ = Vec3(3, 0, -4);
  measured_ = true;
  End end(wire_, parse_address("127.0.0.1:4000"));
  ClientHandshake handshake(
      {.hello = {.role = Role::kController,
                 .name = "curious",
                 .features = {std::string(kFeatureLocalModel), std::string(kFeatureDiagnostics)}}},
      now_);
  std::optional<Session> session;
  std::uint64_t states = 0;
  std::array<std::byte, kMaxDatagram> buffer;
  const auto say = [&](auto& mine) {
    while (const std::size_t size = mine.next_datagram(now_, buffer)) {
      server_.inbox.push_back({end.self, server_.self, {buffer.begin(), buffer.begin() + static_cast<int>(size)}});
    }
  };
  for (int i = 0; i < 2500; ++i) {
    session ? say(*session) : say(handshake);
    run(milliseconds(1), {});
    for (const Datagram& datagram : std::exchange(wire_, {})) {
      if (session) {
        session->receive(now_, datagram.bytes);
      } else {
        handshake.receive(now_, datagram.bytes);
      }
    }
    count_ = 0;
    if (!session && handshake.outcome()) {
      const auto& accepted = std::get<ClientHandshake::Accepted>(*handshake.outcome());
      EXPECT_EQ(accepted.welcome.features, std::vector<std::string>{std::string(kFeatureLocalModel)});
      session.emplace(Session::Config{.connection_id = accepted.connection_id}, now_);
    }
    while (const auto event = session ? session->next_event() : std::nullopt) {
      const auto* arrived = std::get_if<Session::StateArrived>(&*event);
      ASSERT_NE(arrived, nullptr);
      EXPECT_FALSE(arrived->state.force_wanted.has_value());
      ++states;
    }
  }
  EXPECT_GT(states, 2000U);
}

TEST_F(TwoDevices, AnObserverIsToldOfItsDeviceAndOfEachEngineThere) {
  Client left = controller_of(wall_, "192.0.2.1:4000", "left", "main");
  Client right = controller_of(other_, "192.0.2.2:4000", "right", "tissue", true);
  Client waits = controller_of(wall_, "192.0.2.5:4000", "right", "tissue");  // holds nothing: nobody is told of it
  Client watches_left = diagnosing(screen_, "192.0.2.3:4000", "left");
  Client watches_right = diagnosing(screen_, "192.0.2.4:4000", "right");
  measured_ = true;
  run(milliseconds(500), {&left, &right});
  run(milliseconds(2500), {&left, &right, &waits, &watches_left, &watches_right});
  EXPECT_TRUE(right.client->holds());
  EXPECT_EQ(phase(waits), Phase::kOpen);
  EXPECT_FALSE(waits.client->holds());
  ASSERT_TRUE(watches_left.client->device_report() && watches_right.client->device_report());
  EXPECT_EQ(watches_left.client->device_report()->device, 0U);
  EXPECT_EQ(watches_right.client->device_report()->device, 1U);
  ASSERT_EQ(watches_left.client->peer_reports().size(), 1U);
  ASSERT_EQ(watches_right.client->peer_reports().size(), 1U);
  EXPECT_EQ(watches_left.client->peer_reports()[0].name, "wall");
  const PeerReport& tissue = watches_right.client->peer_reports()[0];
  EXPECT_EQ(tissue.name, "other");
  EXPECT_EQ(tissue.device, 1U);
  EXPECT_EQ(tissue.channel, 1U);
  EXPECT_EQ(watches_left.client->stats().link.invalid + watches_right.client->stats().link.invalid, 0U);
}

TEST_F(SealedServer, AForceThatIsNoNumberIsNotToldAndCostsNoState) {
  DeviceState seen;
  Client b = diagnosing(screen_, "192.0.2.2:4000", {}, &seen);
  wanted_ = Vec3(NAN, 0, 0);
  run(milliseconds(500), {&b});
  EXPECT_GT(seen.tick, 400U);
  EXPECT_FALSE(seen.force_wanted.has_value());
  wanted_ = Vec3(0, 2e12, 0);
  run(milliseconds(100), {&b});
  EXPECT_GT(seen.tick, 500U);
  EXPECT_FALSE(seen.force_wanted.has_value());
  EXPECT_EQ(b.client->stats().link.invalid, 0U);
}

TEST_F(SealedServer, WhereTheLogThreadSaysNothingThereIsNoReportOnADevice) {
  Client b = diagnosing(screen_, "192.0.2.2:4000");
  measured_ = true;
  run(milliseconds(1500), {&b});
  ASSERT_TRUE(b.client->device_report().has_value());
  measured_ = false;
  run(seconds(3), {&b});
  EXPECT_EQ(b.client->device_report()->number, 2U);  // what it had said before it fell silent
  health_.steps += 100;                              // it could not count what was lost meanwhile
  measured_ = true;
  run(seconds(1), {&b});
  const DeviceReport& report = *b.client->device_report();
  EXPECT_EQ(report.number, 3U);
  EXPECT_GT(report.span, seconds(3));
  EXPECT_EQ(report.steps, sum(report.lateness) + 100);
  EXPECT_EQ(report.degraded, "the log thread does not follow");
}

TEST_F(SealedServer, SaysThatAnEnginesWayIsFullAndThatItsForcesAreNotTaken) {
  NetworkLoop::Config config;
  config.keys = {wall_, screen_};
  config.adapt_state_rate = true;
  restart(config);
  Client a = controller(wall_, "192.0.2.1:4000");
  Client b = diagnosing(screen_, "192.0.2.2:4000");
  std::uint64_t n = 0;
  run(milliseconds(500), {&a, &b});
  run(seconds(15), {&a, &b}, [&](Datagram& d) { return d.to != a.end->self || ++n % 2 == 0; });
  ASSERT_EQ(b.client->peer_reports().size(), 1U);
  EXPECT_EQ(b.client->peer_reports().front().state_one_in, 20U);
  EXPECT_TRUE(b.client->peer_reports().front().forces_refused);
}

TEST_F(SealedServer, LeavesOutStatesThatAClientCanForetellWhenItAsksForIt) {
  for (const bool asks : {false, true}) {
    Client a{std::make_unique<End>(wire_, parse_address("192.0.2.1:4000")), nullptr};
    ForceClient::Config config = config_of(wall_, ++seed_);
    config.rate_hz = 500;
    if (asks) config.state_deadband = SetStateDeadband{.share = 0.1, .floor = 1e-3, .max_silence = milliseconds(20)};
    std::uint64_t calls = 0;
    std::uint64_t newest = 0;
    a.client = std::make_unique<ForceClient>(
        *a.end, server_.self, config,
        [&](const DeviceState& hand) {
          EXPECT_GT(hand.tick, newest);
          newest = hand.tick;
          ++calls;
          return Touch(Vec3(1, 0, 0));
        },
        now_);
    const std::uint64_t unanswerable = loop_->stats().unanswerable;
    run(seconds(2), {&a});
    if (asks) {
      EXPECT_LT(a.client->stats().states, 150U);  // a hand at rest: one in 20
      EXPECT_GT(loop_->stats().foretold, 1800U);
    } else {
      EXPECT_GT(a.client->stats().states, 1900U);
      EXPECT_EQ(loop_->stats().foretold, 0U);
    }
    EXPECT_GT(calls, 950U);
    EXPECT_EQ(loop_->stats().unanswerable, unanswerable);
    a.client->stop(now_);
    run(milliseconds(10), {&a});
  }
}

TEST_F(SealedServer, TakesForcesThatAnswerAForetoldStepWhichItWasTooLateToSee) {
  Client a{std::make_unique<End>(wire_, parse_address("192.0.2.1:4000")), nullptr};
  ForceClient::Config config = config_of(wall_, ++seed_);
  config.rate_hz = 1000;
  config.state_deadband = SetStateDeadband{.share = 0.1, .floor = 1e-3, .max_silence = milliseconds(20)};
  const LocalTime first_step = now_;
  a.client = std::make_unique<ForceClient>(
      *a.end, server_.self, config, [](const DeviceState&) { return Touch(Vec3(1, 0, 0)); }, now_);
  run(seconds(1), {&a});
  const std::uint64_t unanswerable = loop_->stats().unanswerable;
  const std::uint64_t forces = loop_->stats().forces;
  steps_a_turn_ = 5;
  std::deque<std::pair<LocalTime, Datagram>> to_server;  // 10 ms under way: the step after the answered one is known
  std::uint64_t unseen = 0;
  for (int i = 0; i < 500; ++i) {
    run(milliseconds(1), {&a}, [&](const Datagram& datagram) {
      if (datagram.from != a.end->self) return true;
      to_server.emplace_back(now_ + milliseconds(10), datagram);
      return false;
    });
    for (; !to_server.empty() && to_server.front().first <= now_; to_server.pop_front()) {
      deliver(a.end->self, to_server.front().second.bytes);
    }
    const RemoteForce* const force = mail_->forces[0].take();
    if (force == nullptr) continue;
    // A step a millisecond: when it was sampled is known exactly.
    EXPECT_EQ(force->answers - first_step, milliseconds(force->answers_tick - 1));
    if (force->answers_tick % steps_a_turn_ != 0) ++unseen;
  }
  EXPECT_EQ(loop_->stats().unanswerable, unanswerable);
  EXPECT_GT(loop_->stats().forces - forces, 450U);
  EXPECT_GT(unseen, 90U);  // of those that were the newest in their turn
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

struct Recorded {
  std::size_t strangers = 0;
  std::size_t guests = 0;
};
Recorded take_recorded(Mailboxes& mail, const Address& guest) {
  Recorded recorded;
  for (; const DatagramRecord* datagram = mail.datagrams.front(); mail.datagrams.pop()) {
    ++(datagram->peer == guest ? recorded.guests : recorded.strangers);
  }
  return recorded;
}

TEST_F(SealedServer, AFloodOfStrangersIsASampleAndACountAndGuestsAreWhole) {
  Client client = controller(wall_, "198.51.100.1:1000");
  run(milliseconds(500), {&client});
  take_recorded(*mail_, client.end->self);
  const Bytes junk(1200, std::byte{0x5a});
  const Bytes hello = wire_.front().bytes;  // its first, without a cookie
  Bytes forged;                             // a datagram of the client's session, with its end changed
  const std::size_t before = wire_.size();
  run(milliseconds(100), {&client});
  for (std::size_t i = before; i < wire_.size(); ++i) {
    if (wire_[i].to == server_.self) forged = wire_[i].bytes;
  }
  ASSERT_FALSE(forged.empty());
  forged.back() ^= std::byte{1};
  take_recorded(*mail_, client.end->self);

  const std::size_t on_the_wire = wire_.size();
  constexpr int kFlood = 39;  // a millisecond, each of three kinds
  run(seconds(1), {&client}, [&](Datagram& datagram) {
    if (datagram.from != client.end->self) return true;
    for (int i = 0; i < kFlood / 3; ++i) {
      deliver(parse_address("203.0.113.7:9"), junk);
      deliver(parse_address("203.0.113.7:9"), hello);
      deliver(parse_address("203.0.113.7:9"), forged);
    }
    return true;
  });
  std::size_t guests = 0;
  for (std::size_t i = on_the_wire; i < wire_.size(); ++i) {
    guests += wire_[i].from == client.end->self || wire_[i].to == client.end->self ? 1U : 0U;
  }
  const Recorded recorded = take_recorded(*mail_, client.end->self);
  EXPECT_EQ(recorded.guests, guests);
  EXPECT_GE(recorded.strangers, 16U);
  EXPECT_LE(recorded.strangers, 2 * 16U) << "seconds begin where datagrams do";
  EXPECT_EQ(mail_->datagrams_lost, 0U);
  EXPECT_EQ(mail_->datagrams_over_budget, 0U);
  EXPECT_GT(mail_->strangers_left_out, 39'000U);
}

TEST_F(SealedServer, AGuestThatSendsMoreThanTheBudgetIsCountedAndNotRecorded) {
  NetworkLoop::Config config;
  config.keys = {wall_};
  config.recorded.bytes_per_s = 20'000;
  restart(config);
  Client client = controller(wall_, "198.51.100.1:1000");
  run(seconds(3), {&client});
  std::size_t bytes = 0;
  for (; const DatagramRecord* datagram = mail_->datagrams.front(); mail_->datagrams.pop()) bytes += datagram->size;
  EXPECT_LE(bytes, 4 * 20'000U);
  EXPECT_GE(bytes, 2 * 20'000U);
  EXPECT_GT(mail_->datagrams_over_budget, 1000U);
}

}  // namespace
}  // namespace tendon
