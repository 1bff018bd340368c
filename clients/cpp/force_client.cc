// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/force_client.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

#include "core/base/arithmetic.h"
#include "protocol/expect.h"
#include "protocol/limits.h"
#include "protocol/wire/bounds.h"

namespace tendon {
namespace {

// The numbers are explained at Config::valid_for.
constexpr int kValidPeriods = 3;
constexpr Duration kMinValidFor = std::chrono::milliseconds(20);
constexpr Duration kMaxObservedPeriod = std::chrono::milliseconds(100);
/// The minimum time between two requests for a lease. The current holder renews its lease continuously.
constexpr Duration kAskLeaseAgain = std::chrono::milliseconds(50);

constexpr const char* kNoDiagnostics = "0: only observers can use diagnostics";

void expect_at_most(std::size_t most, const std::string& text, const std::string& field) {
  expect(text.size() <= most, field + ".size", static_cast<double>(text.size()),
         "at most " + std::to_string(most) + " bytes");
}

const ForceClient::Config& checked(const ForceClient::Config& config) {
  expect_at_most(limits::kMaxName, config.name, "name");
  expect_at_most(limits::kMaxLabel, config.device, "device");
  expect_at_most(limits::kMaxLabel, config.channel, "channel");
  expect(config.ways.size() <= limits::kMaxWays, "ways.size", static_cast<double>(config.ways.size()),
         "at most " + std::to_string(limits::kMaxWays) + " names");
  for (auto way = config.ways.begin(); way != config.ways.end(); ++way) {
    const std::string field = "ways[" + std::to_string(way - config.ways.begin()) + "]";
    expect(!way->empty(), field + ".size", 0, "at least 1 byte");
    expect_at_most(limits::kMaxLabel, *way, field);
    if (std::find(config.ways.begin(), way, *way) != way)
      throw std::invalid_argument(field + " = \"" + *way + "\": expected unique names");
  }
  expect(
      config.rate_hz == 0 || (config.rate_hz >= ForceClient::kMinRateHz && config.rate_hz <= ForceClient::kMaxRateHz),
      "rate_hz", config.rate_hz, "0, or 0.001 to 100000");
  expect(config.state_hz <= limits::kMaxLoopHz, "state_hz", config.state_hz, "0 to 1000000");
  expect(config.valid_for >= Duration::zero() && config.valid_for <= limits::kMaxValidFor, "valid_for_s",
         seconds(config.valid_for), "0 to 10");
  expect_above_zero(seconds(config.patience), "patience_s");
  expect_above_zero(seconds(config.retry_min), "retry_min_s");
  expect(config.retry_max >= config.retry_min, "retry_max_s", seconds(config.retry_max), "at least retry_min_s");
  expect(config.max_datagrams > 0, "max_datagrams", config.max_datagrams, "1 or more");
  if (config.deadband) Deadband{*config.deadband};  // throws if invalid
  if (config.state_deadband) {
    const std::string objection = StateDeadband::objection(*config.state_deadband);
    if (!objection.empty()) throw std::invalid_argument("state_deadband." + objection);
  }
  return config;
}

ForceClient::Phase phase_after(const Connection::Ended& ended) {
  switch (ended.cause) {
    case Connection::Cause::kUnanswered:
      return ForceClient::Phase::kUnanswered;
    case Connection::Cause::kRefused:
      return ForceClient::Phase::kRefused;
    case Connection::Cause::kLost:
      break;
  }
  return ended.code == Code::kReplaced ? ForceClient::Phase::kStopped : ForceClient::Phase::kLost;
}

}  // namespace

ForceClient::ForceClient(Link& link, const Address& server, const Config& config, Role role, LocalTime now)
    : config_(checked(config)),
      link_(link),
      role_(role),
      period_(config.rate_hz > 0 ? from_seconds(1 / config.rate_hz) : Duration::zero()),
      connection_(link, server,
                  {.key = config.key,
                   .suites = config.suites,
                   .seed = config.seed,
                   .patience = config.patience,
                   .retry_min = config.retry_min,
                   .retry_max = config.retry_max,
                   .max_datagrams = config.max_datagrams}),
      lease_(kAskLeaseAgain, config.take_lease && role == Role::kController),
      next_call_(now) {
  config_.seed = {};  // otherwise all keys could be read from the memory
  greet(now);
}

ForceClient::ForceClient(Link& link, const Address& server, const Config& config, Physics physics, LocalTime now)
    : ForceClient(link, server, config, Role::kController, now) {
  if (physics == nullptr) throw std::invalid_argument("physics: expected a callback");
  expect(!config.diagnostics, "diagnostics", 1, kNoDiagnostics);
  physics_ = std::move(physics);
}

ForceClient::ForceClient(Link& link, const Address& server, const Config& config, Watch watch, LocalTime now)
    : ForceClient(link, server, config, config.operates ? Role::kController : Role::kObserver, now) {
  if (watch == nullptr) throw std::invalid_argument("watch: expected a callback");
  expect(!(config.operates && config.diagnostics), "diagnostics", 1, kNoDiagnostics);
  watch_ = std::move(watch);
}

bool ForceClient::give_order(const Request& order) {
  Session* const session = connection_.session();
  const auto id = session != nullptr ? session->request(order) : std::nullopt;
  if (!id) return false;
  order_ = id;
  order_answer_.reset();
  return true;
}

bool ForceClient::rearm() { return give_order(Rearm{.device = lease_.place().device}); }

bool ForceClient::disarm() { return give_order(Disarm{.device = lease_.place().device}); }

bool ForceClient::engage() { return give_order(Engage{.device = lease_.place().device}); }

bool ForceClient::disengage() { return give_order(Disengage{.device = lease_.place().device}); }

bool ForceClient::set_scale(double position_scale, double force_scale) {
  const SetScale wanted{.device = lease_.place().device, .position_scale = position_scale, .force_scale = force_scale};
  return refused_field(wanted).empty() && give_order(wanted);
}

bool ForceClient::set_share(std::uint32_t channel, double share) {
  const SetShare wanted{.device = lease_.place().device, .channel = channel, .share = share};
  return channel < limits::kMaxChannels && refused_field(wanted).empty() && give_order(wanted);
}

bool ForceClient::set_output(std::uint32_t output, const OutputSetting& setting) {
  const SetOutput wanted{.device = lease_.place().device, .output = output, .setting = setting};
  return welcome_ && agreed_to(kFeatureOutputs) && refused_field(wanted).empty() && give_order(wanted);
}

bool ForceClient::use(Field field) {
  if (!config_.fields) return false;
  upload_.use(std::move(field));
  return true;
}

bool ForceClient::pose(LocalTime at, const ObjectPose& pose) {
  const auto clock = server_clock();
  if (!clock || !welcome_ || !agreed_to(kFeatureFields) || !holds()) return false;
  connection_.session()->send(FieldPose{.device = lease_.place().device,
                                        .channel = lease_.place().channel,
                                        .sequence = ++poses_,
                                        .time = clock->to_peer(at),
                                        .position = pose.position,
                                        .orientation = pose.orientation,
                                        .velocity = pose.velocity,
                                        .angular_velocity = pose.angular_velocity});
  return true;
}

void ForceClient::upload(LocalTime now) {
  Session* const session = connection_.session();
  if (session == nullptr || !welcome_ || !agreed_to(kFeatureFields)) return;
  upload_.turn(now, *session, lease_.place().device, lease_.place().channel, lease_.holds());
  while (upload_.send_brick(now, *session)) connection_.flush(now);
}

bool ForceClient::take_lease() {
  Session* const session = connection_.session();
  return session != nullptr && lease_.ask(*session);
}

bool ForceClient::give_lease() {
  Session* const session = connection_.session();
  return session != nullptr && lease_.give(*session);
}

LocalTime ForceClient::turn(LocalTime now) {
  if (stats_.phase == Phase::kStopped) return LocalTime::max();
  connection_.flush(now);  // sends a force from answer() before the system calls below
  connection_.begin_turn();
  const LocalTime begun = now;  // next() advances `now` to the receive time
  while (const auto event = connection_.next(now)) take(now, *event);
  if (connection_.session() != nullptr && now >= lease_.due() && !take_lease()) lease_.ask_at(now + kAskLeaseAgain);
  if (config_.fields) upload(now);
  connection_.flush(now);  // send everything that is due before the engine computes
  if (call(now)) connection_.flush(link_.present(now));
  return connection_.more() ? begun : next_turn();
}

void ForceClient::stop(LocalTime now) {
  connection_.close(now, config_.name + " stops");
  end(Phase::kStopped, Code::kOk, "stopped");
}

ForceClient::Stats ForceClient::stats() const {
  Stats stats = stats_;
  stats.link = connection_.link_stats();
  stats.foreign = connection_.foreign();
  return stats;
}

void ForceClient::greet(LocalTime now) {
  Hello hello;
  hello.role = role_;
  hello.name = config_.name;
  hello.features = {std::string(kFeatureLocalModel), std::string(kFeatureChannels), std::string(kFeatureHandle)};
  if (config_.diagnostics) hello.features.emplace_back(kFeatureDiagnostics);
  if (config_.joints) hello.features.emplace_back(kFeatureJoints);
  if (config_.outputs) hello.features.emplace_back(kFeatureOutputs);
  if (config_.fields) hello.features.emplace_back(kFeatureFields);
  if (!config_.ways.empty()) hello.features.emplace_back(kFeatureWays);
  hello.ways = config_.ways;
  if (claims()) hello.claims = {{.device = config_.device, .channel = config_.channel, .role = role_}};
  connection_.greet(now, hello);
  stats_.phase = Phase::kGreeting;
  ++stats_.attempts;
}

void ForceClient::open(LocalTime now, const Welcome& welcome) {
  const auto& grants = welcome.grants;
  if (claims() && grants.size() != 1) {
    connection_.drop(now);
    return end(Phase::kRefused, Code::kUnsupported, "this server has one device with one channel: omit their names");
  }
  welcome_ = welcome;
  lease_.open(grants.empty() ? Grant{.device = 0, .channel = 0, .role = welcome.role} : grants.front(), now);
  description_.reset();
  handle_.reset();
  order_.reset();
  order_answer_.reset();
  stats_.lease_lost_to.clear();
  stats_.left_out = {};
  Session& session = *connection_.session();
  if (claims() || agreed_to(kFeatureHandle)) session.request(Describe{.device = lease_.place().device});
  if (agreed_to(kFeatureHandle)) session.request(Describe{.device = lease_.place().device, .handle = true});
  deadband_request_ = config_.state_deadband ? session.request(*config_.state_deadband) : std::nullopt;
  predicts_ = false;
  seen_tick_ = 0;
  report_.reset();
  device_report_.reset();
  peer_reports_.clear();
  if (config_.state_hz > 0) session.request(SetStateRate{.hz = config_.state_hz, .device = lease_.place().device});
  sequence_ = 0;
  poses_ = 0;
  upload_.begin();
  answered_tick_ = 0;
  if (config_.deadband) deadband_ = HandleDeadband::of_forces(*config_.deadband);  // no force was sent in this session
  stats_.phase = Phase::kOpen;
  ++stats_.sessions;
}

void ForceClient::end(Phase phase, Code code, std::string reason) {
  stats_.phase = phase;
  stats_.code = code;
  stats_.reason = std::move(reason);
  lease_.close();
  upload_.end();
  unseen_ = false;
  newest_.reset();
  pressed_ = 0;
}

void ForceClient::take(LocalTime now, const Connection::Event& event) {
  if (const auto* of_session = std::get_if<const Session::Event*>(&event)) {
    take_event(now, **of_session);
  } else if (const auto* opened = std::get_if<Connection::Opened>(&event)) {
    open(now, opened->welcome);
  } else if (const auto* ended = std::get_if<Connection::Ended>(&event)) {
    end(phase_after(*ended), ended->code, ended->reason);
  } else {
    greet(now);
  }
}

void ForceClient::take_report(const PeerReport& report) {
  const auto known = std::find_if(peer_reports_.begin(), peer_reports_.end(), [&](const PeerReport& one) {
    return one.device == report.device && one.channel == report.channel;
  });
  if (known == peer_reports_.end()) {
    peer_reports_.push_back(report);
  } else {
    *known = report;
  }
}

void ForceClient::take_event(LocalTime now, const Session::Event& event) {
  if (const auto* arrived = std::get_if<Session::StateArrived>(&event)) {
    ++stats_.states;
    if (unseen_) ++stats_.states_skipped;
    newest_ = arrived->state;
    unseen_ = true;
    if (physics_ && !lease_.holds()) pressed_ = 0;  // pressed for another engine
    pressed_ |= arrived->state.buttons;
    newest_arrived_ = now;
  } else if (const auto* report = std::get_if<Session::ReportArrived>(&event)) {
    report_ = report->report;
  } else if (const auto* of_device = std::get_if<Session::DeviceReportArrived>(&event)) {
    device_report_ = of_device->report;
  } else if (const auto* of_peer = std::get_if<Session::PeerReportArrived>(&event)) {
    take_report(of_peer->report);
  } else if (const auto* of_field = std::get_if<Session::FieldStatusArrived>(&event)) {
    upload_.take(now, of_field->status, connection_.session()->stats().smoothed_round_trip);
  } else if (const auto* answered = std::get_if<Session::RequestAnswered>(&event)) {
    take_answer(now, *answered);
  } else if (const auto* asked = std::get_if<Session::RequestArrived>(&event)) {
    take_request(now, *asked);
  }
}

void ForceClient::take_answer(LocalTime now, const Session::RequestAnswered& answered) {
  if (answered.device) description_ = answered.device;
  if (answered.handle) handle_ = answered.handle;
  if (answered.id == order_) order_answer_ = answered;
  upload_.take(now, answered);
  if (answered.id == deadband_request_) {
    predicts_ = answered.code == Code::kOk && period_ > Duration::zero() &&
                config_.state_deadband->max_silence > Duration::zero();
  }
  if (lease_.take(answered, now) && lease_.holds()) stats_.lease_lost_to.clear();
}

void ForceClient::take_request(LocalTime now, const Session::RequestArrived& arrived) {
  const auto* lost = std::get_if<LeaseLost>(&arrived.request);
  Session& session = *connection_.session();
  if (lost == nullptr) return session.answer(arrived.id, Code::kUnsupported, "only a client can send this request");
  session.answer(arrived.id, Code::kOk, {});
  if (lease_.take(*lost, session, now)) stats_.lease_lost_to = lost->to;
}

std::optional<DeviceState> ForceClient::due_state(LocalTime now) {
  if (!predicts_) return std::exchange(unseen_, false) ? newest_ : std::nullopt;
  if (!newest_ || now - newest_arrived_ > config_.state_deadband->max_silence) return {};
  const DeviceState state = predict(*newest_, now - newest_arrived_, haptic_period());
  if (state.tick <= seen_tick_) return {};  // the network delay of the previous state was shorter
  unseen_ = false;
  stats_.states_predicted += state.tick > newest_->tick ? 1 : 0;
  return state;
}

bool ForceClient::call(LocalTime now) {
  if (now < next_call_ || (physics_ && !lease_.holds())) return false;
  std::optional<DeviceState> due = due_state(now);
  if (!due) return false;
  DeviceState& state = *due;
  state.buttons |= std::exchange(pressed_, 0U);
  seen_tick_ = state.tick;
  next_call_ += period_;
  if (next_call_ <= now) next_call_ = now + period_;
  try {
    if (watch_) {
      watch_(state, connection_.link_stats());
      return false;
    }
    const Touch touch = physics_(state);
    if (touch.unknown) return false;
    if (connection_.session() != nullptr) send(now, touch, state);  // unless the callback has called stop()
    return true;
  } catch (...) {
    stop(now);
    throw;
  }
}

bool ForceClient::answer(LocalTime now, const Reply& reply) {
  if (connection_.session() == nullptr || stats_.phase != Phase::kOpen || reply.to.session != stats_.sessions ||
      !lease_.holds() || reply.to.hand.tick < answered_tick_ || reply.touch.unknown) {
    return false;
  }
  send(now, reply.touch, reply.to.hand);
  return true;
}

void ForceClient::leave_out(const Touch& touch, const DeviceState& answered, ForceCommand& command) {
  if (command.model && !agreed_to(kFeatureLocalModel)) command.model.reset();
  if (command.way > config_.ways.size()) stats_.left_out = "the solver path: its number is not in Config::ways";
  if (command.way > config_.ways.size() || (command.way > 0 && !agreed_to(kFeatureWays))) command.way = 0;
  if (!touch.torque && !touch.angular_stiffness && !touch.grip_force) return;
  if (!agreed_to(kFeatureHandle)) {
    stats_.left_out = "torque and grip force: the server does not support them";
    command.torque.reset();
    command.grip_force.reset();
  } else if (touch.angular_stiffness && !answered.turning) {
    stats_.left_out = "angular stiffness: the device does not measure its orientation";
  }
}

void ForceClient::send(LocalTime now, const Touch& touch, const DeviceState& answered) {
  ForceCommand command = to_command(touch, answered);
  command.device = lease_.place().device;
  command.channel = lease_.place().channel;
  if (touch.is_truth) {
    command.field = upload_.progress().generation;
    if (command.field == 0) return;
    command.model.reset();
  }
  leave_out(touch, answered, command);
  if (!in_bounds(command)) {
    ++stats_.forces_unusable;
    stats_.unusable = objection(command);
    return;
  }
  HandleDeadband::Value felt{.vector = command.force, .turning = {}, .grip = command.grip_force};
  if (command.torque) felt.turning = command.torque->torque;
  if (deadband_ && !touch.is_truth && !deadband_->passes(now, felt) && !touch.topology_changed) {
    ++stats_.forces_alike;
    return;
  }
  command.valid_for = touch.valid_for
                          ? std::clamp<Duration>(*touch.valid_for, std::chrono::microseconds(1), limits::kMaxValidFor)
                          : valid_for(answered.tick);
  command.sequence = ++sequence_;
  answered_tick_ = answered.tick;
  connection_.session()->send(command);
  ++stats_.forces;
}

Duration ForceClient::valid_for(std::uint64_t tick) const {
  if (config_.valid_for > Duration::zero()) return config_.valid_for;
  Duration period = period_;
  if (sequence_ > 0) {
    const double apart = static_cast<double>(tick - answered_tick_) / welcome_->loop_hz;
    period = std::max(period, from_seconds(std::min(apart, seconds(kMaxObservedPeriod))));
  }
  if (config_.deadband) period = std::max(period, config_.deadband->longest_silence);
  return std::clamp(kValidPeriods * period, kMinValidFor, limits::kMaxValidFor);
}

Duration ForceClient::haptic_period() const { return from_seconds(1.0 / welcome_->loop_hz); }

LocalTime ForceClient::next_call() const {
  if (!predicts_) return unseen_ ? next_call_ : LocalTime::max();
  if (!newest_) return LocalTime::max();
  const std::uint64_t ahead = seen_tick_ >= newest_->tick ? seen_tick_ + 1 - newest_->tick : 0;
  const LocalTime at = std::max(next_call_, newest_arrived_ + static_cast<Duration::rep>(ahead) * haptic_period());
  return at - newest_arrived_ <= config_.state_deadband->max_silence ? at : LocalTime::max();
}

LocalTime ForceClient::next_turn() const {
  LocalTime next = connection_.next_turn();
  if (connection_.session() == nullptr) return next;
  if (!physics_ || lease_.holds()) next = std::min(next, next_call());
  if (config_.fields && welcome_ && agreed_to(kFeatureFields)) next = std::min(next, upload_.due());
  return std::min(next, lease_.due());
}

}  // namespace tendon
