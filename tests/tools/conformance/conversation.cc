// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/conversation.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "protocol/secrets/seal.h"

namespace tendon::conformance {
namespace {

constexpr Duration kKeepAlive = std::chrono::milliseconds(40);
constexpr std::int64_t kFarthest = std::int64_t{1} << 60;

std::int64_t ns(LocalTime time) { return time.time_since_epoch().count(); }

std::string packet(std::uint64_t number) { return "packet " + std::to_string(number); }

SealingKey sealing(std::uint8_t suite, const Key& key) { return {suite == 2 ? Suite::kAesGcm : Suite::kNoise, key}; }

Key renewed(std::uint8_t suite, const Key& key) {
  return suite == 2 ? crypto::AesGcm(key).renewed() : crypto::renewed(key);
}

std::string must_drop(const std::string& wrong) { return "dropped, because its datagram had " + wrong; }

}  // namespace

Conversation::Conversation(Wire& wire, Report& report, const Setup& setup)
    : wire_(wire), report_(report), setup_(setup), send_key_(setup.send), receive_key_(setup.receive) {
  if (setup.suite == 0) report.not_applicable("data-opens", "suite 0 is not encrypted");
}

Head Conversation::head(std::uint64_t number) const {
  return {.version = setup_.version,
          .type = kDataType,
          .epoch = epoch_,
          .suite = setup_.suite,
          .connection_id = setup_.connection_id,
          .number = number};
}

void Conversation::stamp(pb::Datagram& body) const {
  body.set_tx_time_ns(ns(wire_.now()));
  if (numbers_.empty()) return;
  const auto& [newest, index] = *numbers_.rbegin();
  const Heard& heard = heard_[index];
  std::uint32_t mask = 0;
  for (std::uint64_t i = 0; i < 32 && i < newest; ++i) {
    if (numbers_.contains(newest - 1 - i)) mask |= 1U << i;
  }
  pb::Echo& echo = *body.mutable_echo();
  echo.set_peer_tx_time_ns(heard.body.tx_time_ns());
  echo.set_rx_time_ns(ns(heard.at));
  echo.set_peer_packet_number(newest);
  echo.set_received_mask(mask);
}

Bytes Conversation::seal(Head head, Span body, int epochs) const {
  Key key = send_key_;
  if (epochs < 0 && previous_key_) key = *previous_key_;
  for (int i = 0; i < epochs; ++i) key = renewed(setup_.suite, key);
  head.epoch = static_cast<std::uint8_t>(head.epoch + epochs);
  Bytes out = write(head);
  if (setup_.suite == 0) return out + body;
  Bytes sealed(body.size() + crypto::kTagSize);
  sealing(setup_.suite, key).seal(head.number, out, body, sealed);
  return std::move(out) + sealed;
}

void Conversation::record(std::uint64_t number, const pb::Datagram& body) {
  said_[number] = {.sent_ns = body.tx_time_ns(),
                   .order = order_++,
                   .heard_before_ns = numbers_.empty() ? std::numeric_limits<std::int64_t>::min()
                                                       : heard_[numbers_.rbegin()->second].body.tx_time_ns()};
  bad_.erase(number);
}

Bytes Conversation::compose(std::uint64_t number, pb::Datagram body) {
  if (body.tx_time_ns() == 0) stamp(body);
  record(number, body);
  return seal(head(number), bytes_of(body));
}

void Conversation::say_old(std::uint64_t number) {
  pb::Datagram body;
  stamp(body);
  record(number, body);
  say_bytes(seal(head(number), bytes_of(body), -1));
}

void Conversation::say_at(std::uint64_t number, pb::Datagram body) { say_bytes(compose(number, std::move(body))); }

std::uint64_t Conversation::say(pb::Datagram body) {
  const std::uint64_t number = next_++;
  say_at(number, std::move(body));
  return number;
}

void Conversation::say_bytes(Span datagram) {
  last_said_ = wire_.now();
  wire_.send(setup_.port, datagram);
}

void Conversation::say_bad(std::string_view check, std::uint64_t number, Span datagram, std::string_view wrong) {
  bad_[number] = {check, std::string(wrong)};
  say_bytes(datagram);
}

void Conversation::renew_key() {
  previous_key_ = send_key_;
  send_key_ = renewed(setup_.suite, send_key_);
  ++epoch_;
}

void Conversation::return_to_old_key() {
  send_key_ = *previous_key_;
  --epoch_;
  skip_to(next_ + 40);  // packets sent under the new key are beyond the reach of the ack vector
}

bool Conversation::listen_until(Duration patience, const std::function<bool()>& enough, bool keep_alive) {
  const LocalTime end = wire_.now() + patience;
  for (;;) {
    if (enough()) return true;
    const LocalTime now = wire_.now();
    if (now >= end) return false;
    if (keep_alive && now - last_said_ >= kKeepAlive) say();
    const auto arrival = wire_.receive(setup_.port, keep_alive ? std::min(end, last_said_ + kKeepAlive) : end);
    if (arrival) hear(*arrival);
  }
}

std::optional<bool> Conversation::told_of(std::uint64_t number) const {
  if (numbers_.empty()) return std::nullopt;
  const pb::Datagram& newest = heard_[numbers_.rbegin()->second].body;
  if (!newest.has_echo() || newest.echo().peer_packet_number() < number) return std::nullopt;
  const std::uint64_t behind = newest.echo().peer_packet_number() - number;
  if (behind == 0) return true;
  if (behind > 32) return std::nullopt;
  return (newest.echo().received_mask() >> (behind - 1) & 1U) != 0;
}

bool Conversation::confirmed(std::uint64_t number, Duration patience) {
  return listen_until(patience, [&] { return told_of(number).has_value(); });
}

std::size_t Conversation::count_frames(std::size_t since, const std::function<bool(const pb::Frame&)>& wanted) const {
  std::size_t count = 0;
  for_each_frame(since, [&](const pb::Frame& frame) { count += wanted(frame) ? 1 : 0; });
  return count;
}

void Conversation::hear(const Wire::Arrival& arrival) {
  const auto head = read_head(arrival.datagram);
  if (!head || head->type != kDataType || head->connection_id != setup_.connection_id) {
    strangers_.push_back(arrival.datagram);
    return;
  }
  const Head wanted{.version = setup_.version,
                    .epoch = setup_.suite == 0 ? std::uint8_t{0} : head->epoch,
                    .suite = setup_.suite,
                    .connection_id = setup_.connection_id,
                    .number = head->number};
  report_.judge("data-header", *head == wanted,
                [&] { return std::pair(hex(Span(arrival.datagram).first(kHeadSize)), hex(write(wanted))); });
  report_.judge("data-size", arrival.datagram.size() <= kLargest, std::to_string(arrival.datagram.size()) + " bytes",
                "at most 1200 bytes");

  Bytes body(arrival.datagram.begin() + kHeadSize, arrival.datagram.end());
  if (setup_.suite != 0) {
    const Span all(arrival.datagram);
    const bool is_next = head->epoch == static_cast<std::uint8_t>(receive_epoch_ + 1);
    const Key key = is_next ? renewed(setup_.suite, receive_key_) : receive_key_;
    Bytes text(body.size() < crypto::kTagSize ? 0 : body.size() - crypto::kTagSize);
    const bool opened =
        (is_next || head->epoch == receive_epoch_) && body.size() >= crypto::kTagSize &&
        sealing(setup_.suite, key).open(head->number, all.first(kHeadSize), all.subspan(kHeadSize), text);
    report_.judge("data-opens", opened, [&] {
      return std::pair(
          packet(head->number) + " of epoch " + std::to_string(head->epoch) + ": " + hex(all),
          "encrypted with the key of this direction of epoch " + std::to_string(receive_epoch_) + " or the next one");
    });
    if (!opened) return;
    if (is_next) {
      receive_key_ = key;
      ++receive_epoch_;
    }
    body = text;
  }

  const bool gap_is_ours = std::exchange(moved_, false) && head->number > expected_;
  report_.judge("packet-numbers", head->number == expected_ || gap_is_ours, packet(head->number), packet(expected_));
  if (numbers_.contains(head->number)) return;
  expected_ = std::max(expected_, head->number + 1);

  pb::Datagram content;
  const bool is_message = read(body, content) && content.frames_size() <= 64;
  report_.judge("data-body", is_message,
                [&] { return std::pair(hex(body), std::string("a message Datagram with at most 64 frames")); });
  if (!is_message) return;
  const std::int64_t sent = content.tx_time_ns();
  const bool goes_on = numbers_.empty() || sent >= heard_[numbers_.rbegin()->second].body.tx_time_ns();
  report_.judge("tx-time", goes_on && sent >= -kFarthest && sent <= kFarthest, std::to_string(sent) + " ns",
                "not before that of the previous packet, and within ± 2^60");
  judge_echo(head->number, content);
  numbers_[head->number] = heard_.size();
  heard_.push_back({.number = head->number, .at = arrival.at, .body = std::move(content)});
}

void Conversation::judge_echo(std::uint64_t number, const pb::Datagram& body) {
  if (!body.has_echo()) {
    report_.judge("echo-newest", !echoed_, packet(number) + " has no echo",
                  "an echo, because the previous packet had one");
    return;
  }
  const pb::Echo& echo = body.echo();
  const std::uint64_t told = echo.peer_packet_number();
  if (const auto bad = bad_.find(told); bad != bad_.end()) {
    report_.judge(bad->second.check, false, "an echo of " + packet(told), must_drop(bad->second.wrong));
    return;
  }
  const auto said = said_.find(told);
  report_.judge("echo-newest", said != said_.end(), "an echo of " + packet(told), "an echo of a sent packet");
  if (said == said_.end()) return;
  report_.judge("echo-newest", !echoed_ || told >= newest_echo_, [&] {
    return std::pair(packet(number) + " echoes " + packet(told) + " after one echoed " + packet(newest_echo_),
                     std::string("the highest packet number"));
  });
  newest_echo_ = std::max(newest_echo_, told);
  echoed_ = true;

  const auto times = [&](std::string expected) {
    return [&, expected = std::move(expected)] {
      return std::pair("packet " + std::to_string(told) + ": T1 " + std::to_string(echo.peer_tx_time_ns()) + ", T2 " +
                           std::to_string(echo.rx_time_ns()) + ", T3 " + std::to_string(body.tx_time_ns()),
                       expected);
    };
  };
  report_.judge("echo-times", echo.peer_tx_time_ns() == said->second.sent_ns,
                times("T1 " + std::to_string(said->second.sent_ns)));
  report_.judge("echo-times", echo.rx_time_ns() <= body.tx_time_ns(), times("T2 ≤ T3"));
  if (!report_.failed("tx-time")) {
    report_.judge("echo-times", echo.rx_time_ns() >= said->second.heard_before_ns,
                  times("T2 ≥ " + std::to_string(said->second.heard_before_ns) + ", which this packet answered"));
  }
  const auto [first, is_first] = arrivals_.try_emplace(told, echo.rx_time_ns());
  if (!repeated_.contains(told) || !report_.failed("echo-times")) {
    report_.judge(repeated_.contains(told) ? "replay" : "echo-times", first->second == echo.rx_time_ns(),
                  times("T2 " + std::to_string(first->second) + ", as before"));
  }

  auto known = said;  // the oldest packet sent at or after `other`
  for (std::uint64_t i = 0; i < 32 && i < told; ++i) {
    const std::uint64_t other = told - 1 - i;
    if (known != said_.begin() && std::prev(known)->first == other) --known;
    const bool was_said = known->first == other;
    const bool has = (echo.received_mask() >> i & 1U) != 0;
    const auto mask = [&] { return "echo of " + packet(told) + ", mask " + std::to_string(echo.received_mask()); };
    if (const auto bad = bad_.find(other); bad != bad_.end()) {
      report_.judge(bad->second.check, !has, mask() + ": " + packet(other) + " has arrived",
                    must_drop(bad->second.wrong));
      continue;
    }
    report_.judge("echo-mask", !has || was_said,
                  [&] { return std::pair(mask(), "bit " + std::to_string(i) + " clear: never sent"); });
    const bool must = was_said && known->second.order < said->second.order;
    const auto owner = owners_.find(other);
    if (owner != owners_.end() && report_.failed("echo-mask")) continue;
    report_.judge(owner == owners_.end() ? "echo-mask" : owner->second, has || !must,
                  [&] { return std::pair(mask(), "bit " + std::to_string(i) + " set: sent before"); });
  }
}

std::optional<pb::ControlAck> Conversation::ask(const pb::Control& control) {
  const std::size_t before = heard_.size();
  std::optional<pb::ControlAck> found;
  pb::Datagram body;
  *body.add_frames()->mutable_control() = control;
  for (const LocalTime end = now() + kPatience; !found && now() < end;) {
    say(body);
    listen_until(kRepeat, [&] {
      for_each_frame(before, [&](const pb::Frame& frame) {
        if (frame.has_control_ack() && frame.control_ack().id() == control.id()) found = frame.control_ack();
      });
      return found.has_value();
    });
  }
  return found;
}

}  // namespace tendon::conformance
