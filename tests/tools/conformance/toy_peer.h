// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tests/tools/conformance/opening.h"
#include "tests/tools/conformance/wire.h"

// The smallest server and client that pass, and what happens to them when one rule is broken on purpose: the kit is
// tested with these. In virtual time, without a socket.

namespace tendon::conformance {

/// Which rule is broken.
enum class Fault : std::uint8_t {
  kNone,
  // Data, either end.
  kWrongVersion,
  kSkipsNumbers,
  kTimeGoesBack,
  kEchoOfTheLast,
  kEchoTimeIsNow,
  kEmptyMask,
  kNoKeepAlive,
  kTakesForeignHeaders,
  kTakesMalformed,
  kTakesForged,
  kDamagedUsesNumber,
  kTakesReplays,
  kDropsTheLate,
  kLongWindow,
  kShortWindow,
  kDropsTheUnknown,
  kTakesAnyValue,
  kOlderWins,
  kDoesNotFollowRekey,
  kNoOverlap,
  kOldKeyForEver,
  kNeverRenews,
  kTalksAfterBye,
  kOneBye,
  kNoTimeout,
  kAnythingIsALifeSign,
  kBodyIsNoMessage,
  // A server's.
  kLongRetry,
  kTwoRetries,
  kAnswersShortHellos,
  kTakesAnyHello,
  kOneCookieForAll,
  kBadWelcome,
  kInventsFeatures,
  kSecondSession,
  kLowestVersion,
  kWelcomesAnyVersion,
  kWelcomesPlain,
  kRefusesUnknownKeys,
  kStatesWhileHalfOpen,
  kTwoControllers,
  kWrongReplacedCode,
  kNoHelloLimit,
  kTicksGoBack,
  kAnswersStrays,
  kRoamsByAnything,
  kObserversPush,
  kObserversRearm,
  kObserversDisarm,
  kRequestsAsTheyCome,
  kRequestsAgain,
  kForgetsAnswers,
  kSilentToUnknownRequests,
  kTakesAnyRequestId,
  kGrantsUnasked,
  kGrantsBackwards,
  kGrantsAnything,
  kDescribesAnother,
  kDescribesAnyNumber,
  kAnybodyTakesTheLease,
  kDeniesTheHolder,
  kKeepsTheLease,
  kTakesAnyDeadband,
  kSendsTheForetold,
  kSilentWithDeadband,
  kDeadbandForEver,
  kTellsNothing,
  kReportsAllTheTime,
  kReportsOfOneNumber,
  kReportsBeyondBounds,
  kDiagnosesUnasked,
  kKnowsNoChannels,  ///< no fault: an older server
  // A client's.
  kShortHello,
  kHelloWithConnection,
  kDirtyPadding,
  kCookieFromTheStart,
  kNoRole,
  kSlowHellos,
  kHelloChanges,
  kRandomStays,
  kIgnoresRetries,
  kPingPong,
  kTakesForeignRetry,
  kTakesForeignAnswer,
  kTakesAnyVersion,
  kTakesBadWelcome,
  kTakesPlainAnswer,
  kGoesOnWhenRefused,
  kSequenceStays,
  kValidForAnHour,
  kAnswersNoState,
  kObserverPushes,
  kRequestsFromTwo,
  kAsksOnce,
  kAsksAllTheTime,
  kAsksForEver,
};

/// A peer in this process. Port numbers stand for addresses.
class ToyPeer {
 public:
  struct Outgoing {
    int port;
    Bytes datagram;
  };
  virtual ~ToyPeer() = default;
  virtual void receive(LocalTime now, int port, Span datagram) = 0;
  /// Every millisecond.
  virtual void tick(LocalTime now) = 0;
  std::vector<Outgoing> take() { return std::exchange(out_, {}); }

 protected:
  void send(int port, Bytes datagram) { out_.push_back({port, std::move(datagram)}); }
  std::vector<Outgoing> out_;
};

/// Either end of a toy's open conversation.
class ToySession {
 public:
  ToySession(std::uint8_t suite, std::uint32_t connection_id, const Key& send, const Key& receive, Fault fault,
             LocalTime now);
  bool is(Fault fault) const noexcept { return fault_ == fault; }

  /// The frames to believe; empty when the datagram was dropped. `newest`: it was the highest number.
  struct Content {
    std::vector<pb::Frame> frames;
    bool newest = false;
  };
  std::optional<Content> receive(LocalTime now, Span datagram);
  Bytes say(LocalTime now, const std::vector<pb::Frame>& frames);
  std::vector<Bytes> say_bye(LocalTime now, pb::Code code);
  bool silent_too_long(LocalTime now) const;
  bool over(LocalTime now, Duration timeout) const;
  std::uint32_t connection_id() const noexcept { return connection_id_; }
  std::uint64_t received() const noexcept { return seen_.size(); }
  bool closed = false;

 private:
  bool good_header(const Head& head) const;
  bool seen(std::uint64_t number) const;
  std::optional<Bytes> open(LocalTime now, const Head& head, Span datagram);

  std::uint8_t suite_;
  std::uint32_t connection_id_;
  Key send_;
  Key receive_;
  std::optional<Key> previous_;
  std::uint8_t send_epoch_ = 0;
  std::uint8_t receive_epoch_ = 0;
  LocalTime moved_on_{};
  LocalTime renewed_;
  Fault fault_;
  std::uint64_t next_ = 0;
  std::optional<LocalTime> last_sent_;
  LocalTime last_heard_;
  std::set<std::uint64_t> seen_;
  std::set<std::uint64_t> spoilt_;  ///< by damaged copies
  std::uint64_t echo_number_ = 0;
  std::int64_t echo_sent_ = 0;
  LocalTime echo_at_{};
};

class ToyServer : public ToyPeer {
 public:
  ToyServer(const std::optional<Key>& key, Fault fault);
  void receive(LocalTime now, int port, Span datagram) override;
  void tick(LocalTime now) override;

 private:
  struct Member {
    int port;
    std::string name;
    pb::Role role;
    Sixteen random;
    Bytes answer;
    ToySession session;
    bool open;
    std::uint32_t every = 10;   ///< ms
    std::uint32_t silence = 0;  ///< ms, of a deadband
    std::uint64_t said_at = 0;  ///< tick of the last state
    std::uint64_t sequence = 0;
    std::uint64_t forces = 0;  ///< since the last report
    std::uint64_t reports = 0;
    LocalTime reported{};
    std::map<std::uint32_t, pb::Control> waiting;
    std::map<std::uint32_t, pb::ControlAck> answered;
    std::uint32_t next_request = 1;
    std::vector<pb::Frame> due{};
  };
  bool is(Fault fault) const noexcept { return fault_ == fault; }
  void greet(LocalTime now, int port, Span datagram);
  void refuse(int port, const Greeting& greeting, pb::Code code);
  void take(Member& member, const pb::Frame& frame);
  void execute(Member& member, const pb::Control& control);
  pb::Code set_deadband(Member& member, const pb::SetStateDeadband& asked) const;
  pb::DeviceDescription describe() const;
  const Member* holder() const;
  std::optional<pb::Frame> report(LocalTime now, Member& member) const;
  void open(LocalTime now, Member& member);

  std::optional<Key> key_;
  Fault fault_;
  std::vector<Member> members_;
  std::uint32_t next_id_ = 7;
  std::uint64_t tick_ = 0;
  std::uint64_t rendered_ = 0;
  std::uint32_t holder_ = 0;  ///< connection id
  double hellos_ = 40;
  LocalTime hellos_at_{};
};

class ToyClient : public ToyPeer, public Guest {
 public:
  ToyClient(const std::optional<Key>& key, pb::Role role, bool asks, Fault fault);
  void receive(LocalTime now, int port, Span datagram) override;
  void tick(LocalTime now) override;
  void start() override;
  void ask_to_end() override { ending_ = true; }
  void kill() override { running_ = false; }
  bool running() override { return running_; }

 private:
  bool is(Fault fault) const noexcept { return fault_ == fault; }
  void begin();
  void settle(LocalTime now, Span datagram);
  void say_hello();

  std::optional<Key> key_;
  pb::Role role_;
  bool asks_;
  Fault fault_;
  bool running_ = false;
  bool ending_ = false;
  std::uint8_t attempts_ = 0;
  std::optional<Attempt> attempt_;
  std::optional<Sixteen> cookie_;
  std::optional<LocalTime> hello_at_;
  int hellos_ = 0;
  bool refused_ = false;
  std::optional<ToySession> session_;
  std::optional<std::uint64_t> tick_;
  bool tick_is_new_ = false;
  std::uint64_t sequence_ = 0;
  bool answered_ = false;
  int asked_ = 0;
  LocalTime ask_at_{};
};

/// Virtual time: a millisecond each way.
class ToyWire : public Wire {
 public:
  explicit ToyWire(ToyPeer& peer, bool peer_is_server) : peer_(peer), peer_is_server_(peer_is_server) {}
  LocalTime now() override { return now_; }
  int open_port() override { return peer_is_server_ ? ports_++ : 0; }
  void send(int port, Span datagram) override;
  std::optional<Arrival> receive(int port, LocalTime deadline) override;
  std::uint64_t random() override;

 private:
  struct Letter {
    LocalTime at;
    int port;
    Bytes datagram;
  };
  void step();

  ToyPeer& peer_;
  bool peer_is_server_;
  int ports_ = 0;
  LocalTime now_{std::chrono::seconds(1)};
  std::vector<Letter> to_peer_;
  std::map<int, std::vector<Arrival>> to_us_;
  std::uint64_t state_ = 42;
};

}  // namespace tendon::conformance
