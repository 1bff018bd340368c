// SPDX-License-Identifier: Apache-2.0
#include "clients/c/pull_client.h"

#include <algorithm>
#include <chrono>
#include <cinttypes>
#include <cstdarg>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "clients/cpp/machine.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/text.h"

namespace tendon {
namespace {

/// A limit for the addition of times.
constexpr Duration kLongestSleep = std::chrono::seconds(1);

bool is_permanent(Code code) { return code != Code::kBusy && code != Code::kShutdown; }

ForceClient::Config with_seed(const PullClient::Config& config, const UdpTransport& transport) {
  ForceClient::Config client = config.client;
  client.seed = seed_from_system();
  if (client.device.empty()) client.device = transport.device();
  return client;
}

}  // namespace

PullClient::PullClient(const Config& config)
    : name_(config.server),
      observe_(config.observe),
      poll_(config.poll),
      has_key_(config.client.key.has_value()),
      transport_(name_, has_key_) {
  Link& link = poll_ ? static_cast<Link&>(busy_) : transport_;
  const ForceClient::Config client = with_seed(config, transport_);
  if (observe_) {
    const Watch watch = [this](const DeviceState& hand, const LinkStats& /*link*/) { see(hand); };
    client_.emplace(link, transport_.server(), client, watch, read_clock());
  } else {
    const Physics physics = [this](const DeviceState& hand) {
      see(hand);
      Touch later;
      later.unknown = true;
      return later;
    };
    client_.emplace(link, transport_.server(), client, physics, read_clock());
  }
}

PullClient::~PullClient() {
  try {
    client_->stop(read_clock());
  } catch (...) {  // the server notices the silence
  }
}

int PullClient::fail(int result, const char* format, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(why_.data(), why_.size(), format, arguments);
  va_end(arguments);
  return result;
}

void PullClient::see(const DeviceState& hand) {
  const std::uint32_t pressed = fresh_ ? newest_.buttons : 0;
  skipped_ += fresh_ ? 1 : 0;
  newest_ = hand;
  newest_.buttons |= pressed;
  fresh_ = true;
}

LocalTime PullClient::turn(LocalTime now) {
  const LocalTime next = client_->turn(now);
  if (client_->phase() != phase_) change_phase();
  return next;
}

void PullClient::change_phase() {
  using Phase = ForceClient::Phase;
  const bool was_open = std::exchange(phase_, client_->phase()) == Phase::kOpen;
  const ForceClient::Stats stats = client_->stats();
  session_ = stats.sessions;
  if (was_open) {
    lost_ = true;
    fresh_ = false;  // cannot be answered any more
  }
  if (phase_ == Phase::kGreeting || phase_ == Phase::kOpen) return;
  trouble_ = trouble();
  ended_ = phase_ == Phase::kStopped || (phase_ == Phase::kRefused && is_permanent(stats.code));
  if (ended_) return;
  try {
    transport_.look_up_again(phase_ == Phase::kUnanswered);
    client_->move_to(transport_.server());
  } catch (const std::runtime_error& error) {
    trouble_ = error.what();
  }
}

std::string PullClient::trouble() const {
  const std::string server = name_.at(transport_.server());
  const std::string reason = visible(client_->stats().reason);
  switch (phase_) {
    case ForceClient::Phase::kUnanswered:
      return "no answer from " + server + "; is tendond running there" +
             (has_key_ ? ", and does it have this key?" : "?");
    case ForceClient::Phase::kRefused:
      return server + " refused the connection: " + reason;
    case ForceClient::Phase::kLost:
      return "lost " + server + ": " + reason;
    default:
      return server + " has ended the session: " + reason;
  }
}

void PullClient::sleep(LocalTime now, LocalTime until) {
  until = std::min(until, now + kLongestSleep);
  if (!poll_) return transport_.wait(until - now);
  while (now < until && !busy_.look(now)) {
  }
}

/// The result after a timeout.
int PullClient::idle() {
  if (!connected()) {
    return fail(TENDON_LOST, "%s", trouble_.empty() ? "the server has not answered yet" : trouble_.c_str());
  }
  if (!observe_ && !client_->holds()) {
    const std::string holder = visible(client_->stats().lease_lost_to);
    return fail(TENDON_BUSY, "the channel is held by %s", holder.empty() ? "no or another client" : holder.c_str());
  }
  return fail(TENDON_TIMEOUT, "nothing has happened within the timeout");
}

/// Returns TENDON_OK as soon as done() returns true.
template <class Done>
int PullClient::serve_until(Duration timeout, Done done) {
  LocalTime now = read_clock();
  const bool bounded = timeout >= Duration::zero() && timeout < LocalTime::max() - now;
  const LocalTime end = bounded ? now + timeout : LocalTime::max();
  for (;;) {
    const LocalTime next = turn(now);
    if (done()) return TENDON_OK;
    if (ended_) return fail(TENDON_ENDED, "%s", trouble_.c_str());
    if (std::exchange(lost_, false)) return fail(TENDON_LOST, "%s", trouble_.c_str());
    now = read_clock();
    if (now >= end) return idle();
    sleep(now, std::min(next, end));
    now = read_clock();
  }
}

int PullClient::open(Duration timeout) {
  return serve_until(timeout, [this] { return connected(); });
}

int PullClient::wait(Duration timeout) {
  const int result = serve_until(timeout, [this] { return fresh_; });
  if (result != TENDON_OK) return result;
  fresh_ = false;
  kept_[next_kept_] = {.hand = newest_, .session = session_};
  next_kept_ = (next_kept_ + 1) % kKept;
  return TENDON_OK;
}

int PullClient::send(std::uint64_t tick, const Touch& touch) {
  if (observe_) return fail(TENDON_BAD, "an observer cannot send forces");
  const Kept* answered = nullptr;  // the newest one, since a new server counts from the start
  for (std::size_t i = 1; i <= kKept && answered == nullptr; ++i) {
    const Kept& one = kept_[(next_kept_ + kKept - i) % kKept];
    if (one.session != 0 && one.hand.tick == tick) answered = &one;
  }
  if (answered == nullptr) {
    return fail(TENDON_BAD, "force.tick = %" PRIu64 ": expected the tick of one of the last %zu states", tick, kKept);
  }
  if (const auto objection = tendon::objection(to_command(touch, answered->hand)); !objection.empty()) {
    return fail(TENDON_BAD, "force: %.*s", static_cast<int>(objection.size()), objection.data());
  }
  const LocalTime now = read_clock();
  const bool sent =
      client_->answer(now, {.to = {.hand = answered->hand, .session = answered->session}, .touch = touch});
  turn(now);
  if (sent) return TENDON_OK;
  if (answered->session != session_ || !connected()) {
    return fail(TENDON_LOST, "the session of this state has ended");
  }
  if (!client_->holds()) return idle();
  return fail(TENDON_BAD, "force.tick = %" PRIu64 ": a newer state was answered", tick);
}

bool PullClient::give(const tendon_order& order) {
  switch (order.what) {
    case TENDON_REARM:
      return client_->rearm();
    case TENDON_DISARM:
      return client_->disarm();
    case TENDON_TAKE:
      return client_->take_lease();
    case TENDON_GIVE:
      return client_->give_lease();
    case TENDON_ENGAGE:
      return client_->engage();
    case TENDON_DISENGAGE:
      return client_->disengage();
    case TENDON_SET_SCALE:
      return client_->set_scale(order.value[0], order.value[1]);
    default:
      throw std::invalid_argument("order.what = " + std::to_string(order.what) + ": expected TENDON_REARM or another");
  }
}

int PullClient::request(const tendon_order& order, Duration timeout) {
  const bool lease = order.what == TENDON_TAKE || order.what == TENDON_GIVE;
  if (lease && observe_) return fail(TENDON_BAD, "order.what: an observer has no channel");
  if (lease && connected() && client_->holds() == (order.what == TENDON_TAKE)) return TENDON_OK;
  if (!give(order)) {
    if (!connected()) return idle();
    return fail(TENDON_BAD, "order: a value is out of bounds, or too many requests are pending");
  }
  if (lease) return serve_until(timeout, [&] { return client_->holds() == (order.what == TENDON_TAKE); });
  const int result = serve_until(timeout, [this] { return client_->order_answer().has_value(); });
  if (result != TENDON_OK) return result;
  const Session::RequestAnswered& answer = *client_->order_answer();
  if (answer.code == Code::kOk) return TENDON_OK;
  return fail(TENDON_REFUSED, "the server has refused the request: %s", visible(answer.detail).c_str());
}

int PullClient::describe(Duration timeout) {
  return serve_until(timeout, [this] {
    if (!client_->description()) return false;
    const auto& features = client_->welcome()->features;
    return client_->handle().has_value() || std::ranges::find(features, kFeatureHandle) == features.end();
  });
}

}  // namespace tendon
