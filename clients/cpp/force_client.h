// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/cpp/touch.h"
#include "protocol/connection.h"
#include "protocol/lease_request.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/narrow/deadband.h"
#include "protocol/secrets/crypto.h"
#include "protocol/session.h"

namespace tendon {

/// A state that an engine was shown, to be named when its answer comes later.
struct Seen {
  DeviceState hand{};
  std::uint64_t session = 0;  ///< ForceClient::Stats::sessions when it came
};

/// An answer that took its time, and the state that it is to (ForceClient::answer).
struct Reply {
  Seen to{};
  Touch touch{};
};

/// The physics engine as a function: device state in, force out. It may take its time: while it computes, newer states
/// replace older ones, and a button that was held in one of those is held in the next state that it is shown. Its
/// exceptions pass through ForceClient::turn.
using Physics = std::function<Touch(const DeviceState& hand)>;

/// An onlooker: device state and the state of the link in, nothing out.
using Watch = std::function<void(const DeviceState& hand, const LinkStats& link)>;

/// A guest at a Tendon server. It says Hello, keeps the session alive, hands the newest device state to one callback,
/// sends the force that the callback returns, and starts again when the server is gone. It has no socket, clock or
/// thread.
///
///     ForceClient client(link, server, config, physics, now);
///     for (;;) wait for a datagram, at most until client.turn(now);
///
/// * **Newest wins.** A turn drains the link. The callback sees the newest of the states that came in, once; the others
///   are counted as skipped.
/// * **Rate.** With rate_hz = r the callback is called at multiples of 1/r, or as soon after as there
///   is a state it has not seen; after a delay of a whole period the grid starts anew, it never
///   catches up. With rate_hz = 0 it is called once for every new state.
/// * **Force.** Each carries the tick it answers, a sequence number (1, 2, 3 … per session) and how
///   long it is valid (see Config::valid_for). It leaves in the turn after the one that computed it,
///   which is due at once: the datagram's time stamp must not be older than the physics' work.
///   An answer with a number that is not finite or out of its bounds (WIRE.md) is counted and not sent;
///   the server then treats this client as one that is late.
/// * **Taken over.** When a program with the same key has taken our place, we do not come back: the two would replace
///   each other for ever.
/// * **Reconnection.** However an attempt or a session ends (no answer, refused, Bye, silence), the next
///   attempt waits retry_min, then twice as long each time, at most retry_max. The first state of a
///   new session resets that. Each attempt has a new random.
///
/// Thread-safe: no. Realtime-safe: no.
class ForceClient {
 public:
  struct Config {
    std::string name = "guest";  ///< for the server's log; at most limits::kMaxName bytes
    /// Names of the device and its channel, on a server with several; empty: the first one.
    std::string device{};
    std::string channel{};
    /// When another controller holds the channel's lease: keep asking until we have it. We ask again when the server
    /// says that the lease may be over.
    bool take_lease = false;
    double rate_hz = 0;  ///< calls per second, kMinRateHz … kMaxRateHz; 0 = one for every new state
    /// States per second to ask the server for, 0 … limits::kMaxLoopHz; 0 = what the server gives by itself.
    std::uint32_t state_hz = 0;
    /// How long the server may take a force as fresh, counted from its arrival; at most
    /// limits::kMaxValidFor. 0 = derived from the period T at which forces really leave, that is the
    /// asked one or, when the physics is slower, the time between the states of the last two forces:
    ///
    ///     T         = max(1 / rate_hz, min(Δtick / loop_hz, 100 ms))      with rate_hz = 0: the second term
    ///     valid_for = max(3 T, 20 ms)                          with a deadband: T ≥ its longest silence
    ///
    /// 3 T: two forces in a row may be lost and the third is still in time. 20 ms: an engine at 1 kHz
    /// would otherwise be late by a delay variation of 3 ms. 100 ms: a gap is not a period; an engine
    /// slower than 10 Hz says so by rate_hz.
    Duration valid_for{};
    /// For links where datagrams are dear: a force that a hand cannot tell from the last one sent is not sent (Weber's
    /// law), which leaves a tenth of the datagrams at 1 kHz. Only forces, torques and grip forces are compared
    /// (HandleDeadband): a changed stiffness waits for the next force, at most for the longest silence. A changed
    /// topology is sent at once. Empty: every force is sent.
    std::optional<Deadband::Config> deadband{};
    /// For links where datagrams are dear: the server leaves out states that we can predict, which are most of them.
    /// With rate_hz = r the callback is called at multiples of 1/r with the state predicted for that instant, tick and
    /// sampling time included. It never sees a tick twice, nor an older one. Nothing is predicted for longer than
    /// max_silence: when states are lost, the callback waits for the next one. With rate_hz = 0 it is called for each
    /// state that comes. Empty: we ask for every state. A server that does not know this feature sends every state.
    std::optional<SetStateDeadband> state_deadband{};
    /// For an observer: ask for the forces that the engines want (DeviceState::force_wanted), and once a second for
    /// reports on the device's loop and its engines. A server that does not know this feature leaves them out.
    bool diagnostics = false;
    /// Ask for the joints of the device (DeviceState::joints, HandleDescription::joints): 16 bytes each in every state.
    bool joints = false;
    /// Ask for the outputs of the device (HandleDescription::outputs), to set them with `set_output`.
    bool outputs = false;
    /// Names of the ways in which this engine answers, which Touch::way counts from 1: observers are told, and a
    /// recording holds, by which a force was made. At most limits::kMaxWays, each of 1 to limits::kMaxLabel bytes, no two
    /// alike.
    std::vector<std::string> ways{};
    /// With a Watch: be a controller that sends no force. It may rearm, disarm and hold a
    /// channel.
    bool operates = false;
    /// Shared with the server: all is sealed then, and nothing in the clear is heard. Without one the server must be on
    /// this machine.
    std::optional<Key> key{};
    /// With a key: by which of them the session may be sealed; the server chooses.
    Suites suites = suites_of_this_machine();
    Seed seed{};  ///< of the randoms and keys of the handshakes; 32 bytes from the system at each start
    /// How long one attempt waits for an answer: 20 Hellos at the handshake's 100 ms, enough for a round
    /// trip of 1 s at 50 % loss.
    Duration patience = std::chrono::seconds(2);
    Duration retry_min = std::chrono::milliseconds(100);  ///< first wait before the next attempt; > 0
    /// Longest wait before the next attempt: a server that restarts is found again within it, and one
    /// that refuses us is asked no more often.
    Duration retry_max = std::chrono::seconds(2);
    /// Datagrams taken from the link in one turn: a flood must not keep us from sending. 256 are what a
    /// 1 kHz server sends in a quarter of a second, the longest silence before it stops the device.
    int max_datagrams = 256;
  };
  static constexpr double kMinRateHz = 1e-3;
  static constexpr double kMaxRateHz = 1e5;

  enum class Phase : std::uint8_t {
    kGreeting = 1,    ///< an attempt is under way
    kOpen = 2,        ///< states come in, forces go out
    kUnanswered = 3,  ///< nobody answered; waiting for the next attempt
    kRefused = 4,     ///< the server said no; waiting for the next attempt
    kLost = 5,        ///< the session has ended; waiting for the next attempt
    kStopped = 6,     ///< stop() was called, the callback threw, or another has our place (kReplaced); for good
  };

  struct Stats {
    Phase phase = Phase::kGreeting;
    /// Why the last attempt or session ended: the server's words where it had any.
    Code code = Code::kOk;
    std::string reason;
    LinkStats link;  ///< of the present session, or of the last one
    std::uint64_t attempts = 0;
    std::uint64_t sessions = 0;         ///< of these, answered with a Welcome
    std::uint64_t states = 0;           ///< states that came in
    std::uint64_t states_foretold = 0;  ///< predicted states that the callback saw; they never came
    std::uint64_t states_skipped = 0;   ///< of these, replaced by a newer one before a callback was due
    std::uint64_t forces = 0;           ///< forces sent
    std::uint64_t forces_unusable = 0;  ///< forces not sent: not finite, or out of bounds
    std::string_view unusable{};        ///< what was wrong with the newest of them; empty: none
    std::string_view left_out{};        ///< what of the present session's answers is not sent, and why; empty: nothing
    std::uint64_t forces_alike = 0;     ///< forces not sent: a hand cannot tell them from the previous one
    std::uint64_t strangers = 0;        ///< datagrams that were not from the server: dropped
    std::string lease_lost_to;          ///< name of the client that took the channel from us; empty: nobody
  };

  /// A controller: sees states and sends forces. `link` must outlive this object. The first Hello leaves with the first
  /// turn. Throws std::invalid_argument "FIELD = VALUE: expected …" when a value of `config` is impossible.
  ForceClient(Link& link, const Address& server, const Config& config, Physics physics, LocalTime now);
  /// An observer: sees states, and reports when it asks for them; or an operator (Config::operates). Never sends a
  /// force.
  ForceClient(Link& link, const Address& server, const Config& config, Watch watch, LocalTime now);

  /// Does everything due at `now` and returns the latest time for the next call; call earlier when a datagram arrives.
  /// A force leaves in the turn that has computed it. The callback may have taken its time: read the clock again
  /// before a sleep until then. The callback's exceptions pass through, after a Bye to the server.
  LocalTime turn(LocalTime now);

  /// Shows the callback the newest state once more, in the next turn: for an engine whose answer has changed since it saw
  /// that state, and for which the next state would come late. Nothing happens without a state.
  void answer_again() { unseen_ = newest_.has_value(); }

  /// For an engine that computes elsewhere while this thread goes on: its callback returned an unknown force, and this
  /// is what it has come to. The force leaves with the next turn, which is due at once. False, and nothing is sent:
  /// the session of that state is over, another client holds the channel, or a newer state has been answered. No force
  /// answers an older motion than the one before.
  bool answer(LocalTime now, const Reply& reply);

  /// Asks the server to clear a latched fault of its device, and to take a disarm back; with a safety layer it is the
  /// request to arm. Controllers only: an observer is refused. False when there is no session to ask in, or too many
  /// requests are open.
  bool rearm();
  /// Asks the server for no force, from the device's next step on, until somebody rearms. False as for rearm().
  bool disarm();
  /// The operator's act of a coupling, at the leader's server ([teleoperation]), and its end, at either's. False as for
  /// rearm().
  bool engage();
  bool disengage();
  /// The scales of the coupling from now on, at the leader's server, while it is not engaged or its clutch is held.
  /// False as for rearm(), and beyond 0.01 … 100.
  bool set_scale(double position_scale, double force_scale);
  /// How much the leader of that channel of our device counts among several, at the follower's server: 0 … 1. False as
  /// for rearm(), and out of bounds.
  bool set_share(std::uint32_t channel, double share);
  /// Sets a lamp of the device, or starts a pulse of vibration (`handle()->outputs`). For whoever `holds()`. False as
  /// for rearm(), without Config::outputs, when the server does not know kFeatureOutputs, and out of bounds.
  bool set_output(std::uint32_t output, const OutputSetting& setting);

  /// What the server has said to the newest of these seven of the present session; empty until then.
  const std::optional<Session::RequestAnswered>& order_answer() const noexcept { return order_answer_; }

  /// Whether the channel takes our forces; while it does not, the callback is not called.
  bool holds() const noexcept { return lease_.holds(); }
  /// Asks for the channel's lease, once more when it is lost before the answer; or gives it up. False as for rearm().
  bool take_lease();
  bool give_lease();

  /// The server is found at another address: for the next attempt. To be called while no session is open.
  void move_to(const Address& server) { connection_.move_to(server); }

  /// Says Bye, so that the server need not wait for a timeout, and ends. Any further turn does nothing.
  void stop(LocalTime now);

  Stats stats() const;
  Phase phase() const noexcept { return stats_.phase; }

  /// What the server said of itself and its device when the newest session opened; empty before that.
  const std::optional<Welcome>& welcome() const noexcept { return welcome_; }
  /// What the device is and can do, once the server has answered; empty before, and for good when we have named neither
  /// a device nor a channel and the server does not know kFeatureHandle.
  const std::optional<DeviceDescription>& description() const noexcept { return description_; }
  /// How the device lies before the operator, its buttons' names, and what else its handle can do, once the server has
  /// answered; empty before, and for good when the server does not know kFeatureHandle.
  const std::optional<HandleDescription>& handle() const noexcept { return handle_; }

  /// The server's clock, estimated in the present session; empty without one, and before its first round trip.
  std::optional<ClockOffsetEstimator::Estimate> server_clock() const noexcept {
    return connection_.session() != nullptr ? connection_.session()->peer_clock() : std::nullopt;
  }

  /// The server's newest report on our forces, once a second while they come: late ones by cause, delays, losses.
  /// From the present session; empty before the first.
  const std::optional<LinkReport>& report() const noexcept { return report_; }

  /// With Config::diagnostics: the newest reports on our device's loop, and on the engine of each channel that has one,
  /// in the order of their first reports. From the present session; empty before the first. The last report on an
  /// engine stays when the engine has gone.
  const std::optional<DeviceReport>& device_report() const noexcept { return device_report_; }
  const std::vector<PeerReport>& peer_reports() const noexcept { return peer_reports_; }

 private:
  ForceClient(Link& link, const Address& server, const Config& config, Role role, LocalTime now);

  void greet(LocalTime now);
  void open(LocalTime now, const Welcome& welcome);
  void end(Phase phase, Code code, std::string reason);
  void take(LocalTime now, const Connection::Event& event);
  bool give_order(const Request& order);
  bool agreed_to(std::string_view feature) const {
    return std::find(welcome_->features.begin(), welcome_->features.end(), feature) != welcome_->features.end();
  }
  bool claims() const noexcept { return !config_.device.empty() || !config_.channel.empty(); }
  void take_report(const PeerReport& report);
  void take_event(LocalTime now, const Session::Event& event);
  void take_answer(LocalTime now, const Session::RequestAnswered& answered);
  void take_request(LocalTime now, const Session::RequestArrived& arrived);
  bool call(LocalTime now);
  std::optional<DeviceState> due_state(LocalTime now);
  void send(LocalTime now, const Touch& touch, const DeviceState& answered);
  void leave_out(const Touch& touch, const DeviceState& answered, ForceCommand& command);
  Duration valid_for(std::uint64_t tick) const;
  Duration haptic_period() const;
  LocalTime next_call() const;
  LocalTime next_turn() const;

  Config config_;
  Link& link_;
  Role role_;
  Physics physics_;  ///< the controller's callback
  Watch watch_;      ///< the observer's callback
  Duration period_;  ///< of the callback; 0 = none

  Connection connection_;
  std::optional<Welcome> welcome_;
  std::optional<DeviceDescription> description_;
  std::optional<HandleDescription> handle_;
  std::optional<std::uint32_t> order_;  ///< the newest order, but for leases: number of the request
  std::optional<Session::RequestAnswered> order_answer_;
  LeaseRequest lease_;  ///< of our channel, and the numbers of device and channel

  std::optional<DeviceState> newest_;
  bool unseen_ = false;        ///< the callback has not seen it
  std::uint32_t pressed_ = 0;  ///< buttons held in any of the states since the one that it has seen
  LocalTime newest_arrived_{};
  std::uint64_t seen_tick_ = 0;                      ///< newest tick that the callback has seen
  std::optional<std::uint32_t> deadband_request_{};  ///< … of the states
  bool foretell_ = false;                            ///< the server leaves states out
  LocalTime next_call_{};
  std::optional<HandleDeadband> deadband_;
  std::uint64_t sequence_ = 0;       ///< of the newest force
  std::uint64_t answered_tick_ = 0;  ///< the tick it answers
  std::optional<LinkReport> report_;
  std::optional<DeviceReport> device_report_;
  std::vector<PeerReport> peer_reports_;
  Stats stats_;
};

}  // namespace tendon
