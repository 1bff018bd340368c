// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/toy/client.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "tests/tools/conformance/request_bounds.h"

namespace tendon::conformance {

using std::chrono::milliseconds;
using std::chrono::seconds;

ToyClient::ToyClient(const std::optional<Key>& key, pb::Role role, bool asks, Fault fault)
    : key_(key), role_(role), asks_(asks), fault_(fault) {}

void ToyClient::start() {
  running_ = true;
  ending_ = false;
  begin();
}

void ToyClient::begin() {
  ++attempts_;
  pb::Hello hello;
  hello.set_version_min(1);
  hello.set_version_max(1);
  if (!is(Fault::kNoRole)) hello.set_role(role_);
  for (int i = 0; i < 9 && is(Fault::kNineWays); ++i) hello.add_ways("way");
  hello.set_name("toy");
  hello.add_features("channels");
  if (key_ && !is(Fault::kKnowsNoAes)) hello.add_features(std::string(kAesGcm));
  const Sixteen random{std::byte{0xAA}, is(Fault::kRandomStays) ? std::byte{1} : std::byte{attempts_}};
  const Key ephemeral = key_from(is(Fault::kRandomStays) ? 100 : static_cast<std::uint8_t>(100 + attempts_));
  attempt_.emplace(key_, bytes_of(hello), random, ephemeral);
  cookie_.reset();
  if (is(Fault::kCookieFromTheStart)) cookie_ = Sixteen{std::byte{9}};
  hello_at_.reset();
  hellos_ = 0;
  refused_ = false;
  session_.reset();
  tick_.reset();
  tick_is_new_ = false;
  sequence_ = 0;
  answered_ = false;
  asked_ = 0;
  answers_.clear();
  due_.clear();
}

void ToyClient::say_hello() {
  Bytes out = attempt_->hello(cookie_.value_or(Sixteen{}));
  if (is(Fault::kShortHello)) out.pop_back();
  if (is(Fault::kHelloWithConnection)) out[4] = std::byte{1};
  if (is(Fault::kDirtyPadding)) out.back() = std::byte{1};
  if (is(Fault::kHelloChanges) && hellos_ % 2 == 1) {
    // The same random with another body: in suite 1 one ephemeral key would seal two texts.
    pb::Hello hello;
    hello.set_version_min(1);
    hello.set_version_max(1);
    hello.set_role(role_);
    hello.set_name("changed");
    out = Attempt(key_, bytes_of(hello), attempt_->random(), key_from(99)).hello(cookie_.value_or(Sixteen{}));
  }
  ++hellos_;
  send(0, out);
}

void ToyClient::settle(LocalTime now, Span datagram) {
  const auto head = read_head(datagram);
  const bool plain_taken = is(Fault::kTakesPlainAnswer) && head->suite == 0;
  if (head->suite != (key_ ? 1 : 0) && !plain_taken) return;
  Bytes bytes(datagram.begin(), datagram.end());
  if (is(Fault::kTakesForeignAnswer)) std::ranges::copy(attempt_->random(), bytes.begin() + 16);
  const auto answered = attempt_->read(bytes);
  if (!answered) return;
  if (answered->body.has_refused()) {
    refused_ = true;
    return;
  }
  const pb::Welcome& welcome = answered->body.welcome();
  const bool good = answered->body.has_welcome() && welcome.loop_hz() >= 1 && welcome.timeout_ms() >= 1 &&
                    welcome.role() != 0 && welcome.max_force_n() >= 0;
  if (welcome.version() != 1 && !(is(Fault::kTakesAnyVersion) && good)) return;
  if (!good && !is(Fault::kTakesBadWelcome)) return;
  session_.emplace(key_ && head->suite == 1 ? answered->suite : 0, head->connection_id, answered->client_to_server,
                   answered->server_to_client, fault_, now);
}

void ToyClient::take(const pb::Control& control) {
  const std::string field = field_out_of_bounds(control);
  if (control.id() == 0 || (is(Fault::kSilentToBadRequests) && !field.empty())) return;
  if (control.id() == answers_.size() + 1) {
    pb::ControlAck& ack = answers_.emplace_back();
    ack.set_id(control.id());
    ack.set_code(field.empty() ? pb::CODE_UNSUPPORTED : pb::CODE_INVALID);
    ack.set_detail(field);
  }
  if (control.id() <= answers_.size()) due_.push_back(answers_[control.id() - 1]);
}

void ToyClient::receive(LocalTime now, int, Span datagram) {
  if (!running_) return;
  const auto head = read_head(datagram);
  if (!session_) {
    if (!head || refused_) return;
    const bool ours = sixteen(datagram, 16) == attempt_->random() || is(Fault::kTakesForeignRetry);
    if (head->type == kRetryType && ours && !is(Fault::kIgnoresRetries)) {
      if (!cookie_ || is(Fault::kPingPong)) hello_at_.reset();
      cookie_ = sixteen(datagram, 32);
    }
    if (head->type == kAnswerType) settle(now, datagram);
    return;
  }
  const auto content = session_->receive(now, datagram);
  if (!content) return;
  for (const pb::Frame& frame : content->frames) {
    if (frame.has_state() && (!tick_ || frame.state().tick() > *tick_ || is(Fault::kOlderWins))) {
      tick_ = frame.state().tick();
      tick_is_new_ = true;
    }
    if (frame.has_control_ack()) answered_ = true;
    if (frame.has_control()) take(frame.control());
  }
}

void ToyClient::tick(LocalTime now) {
  if (!running_) return;
  if (!session_) {
    if (refused_ && !is(Fault::kGoesOnWhenRefused)) return;
    if (hello_at_ && now - *hello_at_ < milliseconds(is(Fault::kSlowHellos) ? 900 : 100)) return;
    hello_at_ = now;
    return say_hello();
  }
  ToySession& session = *session_;
  if (session.closed || session.over(now, seconds(2))) return begin();
  if (ending_) {
    for (Bytes& bye : session.say_bye(now, pb::CODE_OK)) send(0, std::move(bye));
    running_ = false;
    return;
  }
  std::vector<pb::Frame> frames;
  for (const pb::ControlAck& ack : std::exchange(due_, {})) *frames.emplace_back().mutable_control_ack() = ack;
  if (std::exchange(tick_is_new_, false) && (role_ == pb::ROLE_CONTROLLER || is(Fault::kObserverPushes))) {
    frames.emplace_back();
    pb::ForceCommand& force = *frames.back().mutable_force();
    force.set_sequence(is(Fault::kSequenceStays) ? 1 : ++sequence_);
    force.set_based_on_tick(*tick_);
    force.set_valid_for_us(is(Fault::kValidForAnHour) ? 3'600'000'000U : 20'000);
    if (is(Fault::kSaysWaysUnasked)) force.set_way(1);
    if (is(Fault::kTurnsUnasked)) force.mutable_torque_nm()->set_z(0.01);
    if (is(Fault::kAnswersNoState) && sequence_ == 3) {
      frames.push_back(frames.back());
      frames.back().mutable_force()->set_sequence(++sequence_);
      frames.back().mutable_force()->set_based_on_tick(*tick_ + 7'000'000);
    }
  }
  const Duration wait = is(Fault::kAsksAllTheTime) ? milliseconds(20) : milliseconds(20) * (1 << std::min(asked_, 6));
  const bool done = (answered_ && !is(Fault::kAsksForEver)) || (is(Fault::kAsksOnce) && asked_ > 0);
  if (asks_ && !done && now >= ask_at_) {
    ask_at_ = now + std::min<Duration>(wait, seconds(1));
    ++asked_;
    frames.emplace_back();
    pb::Control& control = *frames.back().mutable_control();
    control.set_id(is(Fault::kRequestsFromTwo) ? 2 : 1);
    control.mutable_set_state_rate()->set_hz(100);
  }
  if (!frames.empty() || session.silent_too_long(now)) send(0, session.say(now, frames));
}

}  // namespace tendon::conformance
