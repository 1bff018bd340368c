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

#include "clients/cpp/field/field.h"
#include "clients/cpp/field/field_upload.h"
#include "clients/cpp/touch.h"
#include "protocol/bandwidth/deadband.h"
#include "protocol/connection.h"
#include "protocol/lease_request.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/secrets/crypto.h"
#include "protocol/session.h"

namespace tendon {

/// A device state that the callback received, kept so that an answer computed later can refer to it.
struct Seen {
  DeviceState hand{};
  std::uint64_t session = 0;
};

/// A delayed answer and the state that it answers. See ForceClient::answer.
struct Reply {
  Seen to{};
  Touch touch{};
};

/// The physics engine, from device state to force. It may block: newer states replace older ones meanwhile, and the
/// next state reports every button pressed in a skipped one. Exceptions propagate through ForceClient::turn.
using Physics = std::function<Touch(const DeviceState& hand)>;

using Watch = std::function<void(const DeviceState& hand, const LinkStats& link)>;  ///< callback of an observer

/// A client of a Tendon server. It opens a session and keeps it alive, passes the newest device state to one callback,
/// sends the returned force, and reconnects after the session ends. This class does not use sockets, clocks or threads.
///
///     ForceClient client(link, server, config, physics, now);
///     for (;;) wait for a datagram, at most until client.turn(now);
///
/// * **Newest wins.** Each turn drains the link. The callback gets the newest state; the others count as skipped.
/// * **Rate.** With rate_hz = r > 0, the callback runs at multiples of 1/r, or with the next new state after that. A
///   full period's delay restarts the schedule; missed calls are not made up. With rate_hz = 0, for each new state.
/// * **Force.** Each force carries the tick of the state that it answers, a sequence number (1, 2, 3 … per session),
///   its validity (Config::valid_for) and the time at which the callback returned. Forces that are not finite or out of
///   the bounds in WIRE.md are counted and not sent; the server then treats this client as late.
/// * **Replacement.** If another program with the same key replaces this client, the client stops and does not
///   reconnect. Otherwise the two programs would keep replacing each other.
/// * **Reconnection.** After an attempt or a session ends (no answer, refusal, Bye, silence), the client waits for
///   retry_min. Each attempt doubles it up to retry_max and uses new random numbers; the first state of a session
///   resets it.
///
/// Thread-safe: no. Realtime-safe: no.
class ForceClient {
 public:
  struct Config {
    std::string name = "guest";  ///< for the log of the server; at most limits::kMaxName bytes
    /// Names of the device and its channel. Empty: the first one of the server.
    std::string device{};
    std::string channel{};
    /// Keeps asking if another controller holds the channel, whenever the server reports that its lease may have ended.
    bool take_lease = false;
    double rate_hz = 0;          ///< calls per second, kMinRateHz … kMaxRateHz; 0: one call for each new state
    std::uint32_t state_hz = 0;  ///< states per second to request, 0 … limits::kMaxLoopHz; 0: the default of the server
    /// How long after its arrival the server may use a force; at most limits::kMaxValidFor. 0: derived from the period
    /// T between forces, as requested or, for a slower engine, between the states that the last two forces answer:
    ///
    ///     T         = max(1 / rate_hz, min(Δtick / loop_hz, 100 ms))      if rate_hz = 0: the second term
    ///     valid_for = max(3 T, 20 ms)                          with a deadband: T ≥ its longest silence
    ///
    /// 3 T tolerates the loss of two consecutive forces. 20 ms tolerates jitter, which would make an engine at 1 kHz
    /// late after 3 ms. 100 ms prevents a pause from being taken for a period: an engine below 10 Hz must set rate_hz.
    Duration valid_for{};
    /// For slow links: omits forces that a human cannot distinguish from the last one sent (Weber's law), about 90 % of
    /// the datagrams at 1 kHz. Compares forces, torques and grip forces only (HandleDeadband). A changed stiffness
    /// waits for the next force, at most the longest silence; a changed topology is sent immediately. Empty: send all.
    std::optional<Deadband::Config> deadband{};
    /// For slow links: the server omits states that the client can predict. With rate_hz = r > 0, the callback runs at
    /// multiples of 1/r with the state predicted for that time, with its tick (always increasing) and sampling time,
    /// for at most max_silence, and then waits for the next state. With rate_hz = 0, it runs for each received state.
    /// Empty: all states are requested. Servers without this feature send every state.
    std::optional<SetStateDeadband> state_deadband{};
    /// For observers: requests the forces of the engines before limiting (DeviceState::force_wanted), and reports on
    /// the loop of the device and its engines once per second. Servers that do not support this feature omit them.
    bool diagnostics = false;
    /// Requests the joints (DeviceState::joints, HandleDescription::joints): 16 bytes per joint and state.
    bool joints = false;
    bool outputs = false;  ///< requests access to the outputs (HandleDescription::outputs), for set_output()
    bool fields = false;   ///< requests that the server renders fields, for use(). Only for controllers
    /// Names of the methods with which this engine computes forces, for observers and recordings. Touch::way is an
    /// index into them, starting at 1. At most limits::kMaxWays unique names of 1 to limits::kMaxLabel bytes.
    std::vector<std::string> ways{};
    /// Only with a Watch: register as a controller that sends no forces but may rearm, disarm and hold a channel.
    bool operates = false;
    /// Shared with the server. With a key, all traffic is encrypted and unencrypted datagrams are ignored. Without a
    /// key, the server must run on this machine.
    std::optional<Key> key{};
    Suites suites = suites_of_this_machine();  ///< offered for an encrypted session; the server selects one
    Seed seed{};  ///< for the handshakes; must be 32 new bytes from the operating system for each object
    /// The timeout of an attempt: 20 Hellos at intervals of 100 ms, enough for a round trip of 1 s at 50 % loss.
    Duration patience = std::chrono::seconds(2);
    Duration retry_min = std::chrono::milliseconds(100);  ///< wait before the first retry; > 0
    /// The maximum wait. It bounds the time to find a restarted server and the load on a server that refuses.
    Duration retry_max = std::chrono::seconds(2);
    /// The maximum number of datagrams read in one turn, so that a flood cannot prevent sending. A server at 1 kHz
    /// sends 256 datagrams in a quarter of a second, the longest silence before it stops the device.
    int max_datagrams = 256;
  };
  static constexpr double kMinRateHz = 1e-3;
  static constexpr double kMaxRateHz = 1e5;

  enum class Phase : std::uint8_t {
    kGreeting = 1,    ///< waiting for an answer to the handshake
    kOpen = 2,        ///< session open
    kUnanswered = 3,  ///< waiting after an attempt without an answer
    kRefused = 4,     ///< waiting after a refusal
    kLost = 5,        ///< waiting after a session has ended
    kStopped = 6,     ///< final: stop(), an exception, or replacement (kReplaced)
  };

  struct Stats {
    Phase phase = Phase::kGreeting;
    /// The reason for the end of the last attempt or session. Contains the message of the server if there is one.
    Code code = Code::kOk;
    std::string reason;
    LinkStats link;  ///< of the newest session
    std::uint64_t attempts = 0;
    std::uint64_t sessions = 0;  ///< attempts that the server accepted
    std::uint64_t states = 0;
    std::uint64_t states_predicted = 0;  ///< predicted states that the callback received
    std::uint64_t states_skipped = 0;    ///< received states that a newer one replaced before the callback ran
    std::uint64_t forces = 0;
    std::uint64_t forces_unusable = 0;  ///< forces not sent because they are not finite or out of bounds
    std::string_view unusable{};        ///< reason for the newest unusable force; empty: none
    std::string_view left_out{};        ///< the omitted part of the forces, and the reason
    std::uint64_t forces_alike = 0;     ///< forces not sent because they are within the deadband
    std::uint64_t foreign = 0;          ///< datagrams dropped because they did not come from the server
    std::string lease_lost_to;          ///< the client that has taken over the channel
  };

  /// Creates a controller, which receives states and sends forces. `link` must outlive this object. The first Hello
  /// is sent by the first turn. Throws std::invalid_argument "FIELD = VALUE: expected …" if `config` is invalid.
  ForceClient(Link& link, const Address& server, const Config& config, Physics physics, LocalTime now);
  /// Creates an observer of states and, if requested, reports; or an operator (Config::operates). Never sends a force.
  ForceClient(Link& link, const Address& server, const Config& config, Watch watch, LocalTime now);

  /// Performs the work due at `now` and returns the time of the next call; call it earlier if a datagram arrives. The
  /// callback may take long: read the clock again before sleeping. Its exceptions propagate after a Bye.
  LocalTime turn(LocalTime now);

  /// Passes the newest state to the callback again in the next turn. Use it if the answer of the engine has changed
  /// and waiting for the next state would take too long. Does nothing if no state has arrived.
  void answer_again() { unseen_ = newest_.has_value(); }

  /// Sends a force that was computed after the callback returned Touch::unknown. The next turn, which sends it, is due
  /// now. Returns false if the session has ended, another client has the channel, or a newer state was answered.
  bool answer(LocalTime now, const Reply& reply);

  /// Asks the server to clear a latched fault and undo a disarm; with a safety layer, to arm. Only for controllers; the
  /// server refuses observers. Returns false without a session or if too many requests are pending.
  bool rearm();
  /// Asks the server to disable all forces from the device's next step until a client rearms. Returns as rearm() does.
  bool disarm();
  /// Engages or disengages a coupling of two devices ([teleoperation] in the scene). engage() must be sent to the
  /// server of the leader, disengage() to either server. Returns false as rearm() does.
  bool engage();
  bool disengage();
  /// Sets the scales of the coupling at the server of the leader. Allowed while the coupling is not engaged or its
  /// clutch is held. Returns false as rearm() does, and if a scale is outside of 0.01 … 100.
  bool set_scale(double position_scale, double force_scale);
  /// Sets the weight, 0 … 1, of the leader on that channel if several leaders share one follower. Must be sent to the
  /// server of the follower. Returns false as rearm() does, and if the weight is out of bounds.
  bool set_share(std::uint32_t channel, double share);
  /// Sets an indicator lamp or starts a vibration pulse (`handle()->outputs`). Requires `holds()`. Returns false as
  /// rearm() does, without Config::outputs or the server's kFeatureOutputs, or for a `setting` out of bounds.
  bool set_output(std::uint32_t output, const OutputSetting& setting);

  /// Uploads a field in this session and in later ones, and renders it while `holds()`. The callback should then return
  /// Touch::truth or Touch::unknown, or a force that is added. Replaces the last field. Returns false, without effect,
  /// if Config::fields is false. Throws std::invalid_argument with the name of a number that is out of bounds.
  bool use(Field field);
  void stop_using() noexcept { upload_.drop(); }  ///< a field
  /// Moves the object of the field. `at` is the time of the pose, which should be half a round trip after now, on the
  /// local clock. If poses are sent before the field is in use, the object does not first appear at the origin. Returns
  /// false without the server's kFeatureFields, unless `holds()`, or before the first round trip.
  bool pose(LocalTime at, const ObjectPose& pose);
  const FieldUpload::Progress& field() const noexcept { return upload_.progress(); }

  /// The server's answer to the most recent of these requests in this session; empty if there is none.
  const std::optional<Session::RequestAnswered>& order_answer() const noexcept { return order_answer_; }

  bool holds() const noexcept { return lease_.holds(); }  ///< holds the channel; otherwise the callback is not called
  /// Requests or releases the lease of the channel; repeated if lost before the answer arrives. Return as rearm() does.
  bool take_lease();
  bool give_lease();

  /// Sets the server address for the next attempt. This must only be called while no session is open.
  void move_to(const Address& server) { connection_.move_to(server); }

  /// Sends a Bye, so that the server does not have to wait for a timeout, and stops. Further turns do nothing.
  void stop(LocalTime now);

  Stats stats() const;
  Phase phase() const noexcept { return stats_.phase; }

  /// Description of the server in the newest session; empty before the first.
  const std::optional<Welcome>& welcome() const noexcept { return welcome_; }
  /// Description of the device; empty until it arrives. It never arrives if Config names neither a device nor a
  /// channel and the server does not support kFeatureHandle.
  const std::optional<DeviceDescription>& description() const noexcept { return description_; }
  /// Orientation of the device relative to the operator, names of the buttons, and other properties of the handle;
  /// empty until it arrives. It never arrives if the server does not support kFeatureHandle.
  const std::optional<HandleDescription>& handle() const noexcept { return handle_; }

  /// Estimate of the server's clock in this session; empty without a session and before the first round trip.
  std::optional<ClockOffsetEstimator::Estimate> server_clock() const noexcept {
    return connection_.session() != nullptr ? connection_.session()->peer_clock() : std::nullopt;
  }

  /// Newest report of the server on the received forces: late forces by cause, delays, losses. Sent once per second
  /// while forces arrive. Empty before the first report of this session.
  const std::optional<LinkReport>& report() const noexcept { return report_; }

  /// The newest reports on the loop of the device and on the engine of each channel, in the order of their first
  /// reports. They are kept when the engine leaves. Empty before the first report. Requires Config::diagnostics.
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
  void upload(LocalTime now);
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
  Physics physics_;
  Watch watch_;
  Duration period_;

  Connection connection_;
  std::optional<Welcome> welcome_;
  std::optional<DeviceDescription> description_;
  std::optional<HandleDescription> handle_;
  std::optional<std::uint32_t> order_;  ///< request id (not for leases)
  std::optional<Session::RequestAnswered> order_answer_;
  LeaseRequest lease_;  ///< also stores the indices of the device and the channel

  std::optional<DeviceState> newest_;
  bool unseen_ = false;        ///< the callback has not received newest_
  std::uint32_t pressed_ = 0;  ///< buttons pressed in any state since the last callback
  LocalTime newest_arrived_{};
  std::uint64_t seen_tick_ = 0;                      ///< newest tick passed to the callback
  std::optional<std::uint32_t> deadband_request_{};  ///< request id
  bool predicts_ = false;                            ///< the server omits predictable states
  LocalTime next_call_{};
  std::optional<HandleDeadband> deadband_;
  std::uint64_t sequence_ = 0;  ///< of the newest force
  std::uint64_t poses_ = 0;     ///< sent in this session
  FieldUpload upload_;
  std::uint64_t answered_tick_ = 0;  ///< state tick that the newest force answers
  std::optional<LinkReport> report_;
  std::optional<DeviceReport> device_report_;
  std::vector<PeerReport> peer_reports_;
  Stats stats_;
};

}  // namespace tendon
