// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/toy/session.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "core/base/bytes.h"

namespace tendon::conformance {

using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

constexpr std::uint64_t kRemembered = 1984;

bool within_bounds(const pb::DeviceState& state) {
  return !far(state.position_m()) && !far(state.velocity_mps()) && !far(state.force_applied_n()) &&
         !far(state.energy_j()) && state.permitted_force_n() >= 0 && state.mode() >= 1 && state.mode() <= 6;
}

bool within_bounds(const pb::Frame& frame) {
  if (frame.has_state()) return within_bounds(frame.state());
  if (frame.has_force()) return frame.force().sequence() > 0 && conformance::within_bounds(frame.force());
  return true;
}

bool has_unknown(const pb::Datagram& body) {
  const auto unknown = [](const auto& message) { return !message.GetReflection()->GetUnknownFields(message).empty(); };
  return unknown(body) || std::ranges::any_of(body.frames(), unknown);
}

}  // namespace

ToySession::ToySession(std::uint8_t suite, std::uint32_t connection_id, const Key& send, const Key& receive,
                       Fault fault, LocalTime now)
    : suite_(suite),
      connection_id_(connection_id),
      send_(send),
      receive_(receive),
      renewed_(now),
      fault_(fault),
      last_heard_(now) {}

SealingKey ToySession::sealing(const Key& key) const { return {suite_ == 2 ? Suite::kAesGcm : Suite::kNoise, key}; }

Key ToySession::renewed(const Key& key) const {
  return suite_ == 2 ? crypto::AesGcm(key).renewed() : crypto::renewed(key);
}

bool ToySession::good_header(const Head& head) const {
  if (is(Fault::kTakesForeignHeaders)) return head.connection_id == connection_id_ && head.number < 1ULL << 60;
  return head.magic == 0x54 && head.version == 1 && head.type == kDataType && head.suite == suite_ &&
         head.connection_id == connection_id_ && head.number < std::uint64_t{1} << 60;
}

bool ToySession::seen(std::uint64_t number) const {
  if (seen_.empty()) return false;
  const std::uint64_t newest = *seen_.rbegin();
  const std::uint64_t window = is(Fault::kLongWindow) ? 100'000 : is(Fault::kShortWindow) ? 1000 : kRemembered;
  if (number < newest && newest - number >= window) return true;
  return (seen_.contains(number) && !is(Fault::kTakesReplays)) || (is(Fault::kDropsTheLate) && number < newest);
}

std::optional<Bytes> ToySession::open(LocalTime now, const Head& head, Span datagram) {
  if (suite_ == 0) return Bytes(datagram.begin() + kHeadSize, datagram.end());
  if (datagram.size() < kHeadSize + crypto::kTagSize) return std::nullopt;
  if (previous_ && !is(Fault::kOldKeyForEver) && now - moved_on_ >= seconds(2)) previous_.reset();
  const auto ahead = static_cast<std::uint8_t>(head.epoch - receive_epoch_);
  Key key = receive_;
  if (ahead == 1 && !is(Fault::kDoesNotFollowRekey)) {
    key = renewed(receive_);
  } else if (ahead == 0xFF && previous_ && !is(Fault::kNoOverlap)) {
    key = *previous_;
  } else if (ahead != 0) {
    return std::nullopt;
  }
  Bytes text(datagram.size() - kHeadSize - crypto::kTagSize);
  const Span sealed = datagram.subspan(kHeadSize);
  if (!sealing(key).open(head.number, datagram.first(kHeadSize), sealed, text)) {
    if (is(Fault::kTakesForged)) return Bytes();
    return std::nullopt;
  }
  if (ahead == 1) {
    previous_ = receive_;
    receive_ = key;
    ++receive_epoch_;
    moved_on_ = now;
  }
  return text;
}

std::optional<ToySession::Content> ToySession::receive(LocalTime now, Span datagram) {
  if (is(Fault::kAnythingIsALifeSign)) last_heard_ = now;
  const auto head = read_head(datagram);
  if (closed || !head || !good_header(*head)) return std::nullopt;
  if (datagram.size() > kLargest && !is(Fault::kTakesForeignHeaders)) return std::nullopt;
  if (seen(head->number) || spoilt_.contains(head->number)) return std::nullopt;
  const bool newest_number = seen_.empty() || head->number > *seen_.rbegin();
  const bool again = seen_.contains(head->number);
  const auto bytes = open(now, *head, datagram);
  if (!bytes) {
    if (is(Fault::kDamagedUsesNumber)) spoilt_.insert(head->number);
    return std::nullopt;
  }
  pb::Datagram body;
  const bool well_formed = read(*bytes, body) && body.frames_size() <= 64 &&
                           body.tx_time_ns() <= std::int64_t{1} << 60 && body.tx_time_ns() >= -(std::int64_t{1} << 60);
  bool good = well_formed || is(Fault::kTakesMalformed);
  if (is(Fault::kDropsTheUnknown) && has_unknown(body)) good = false;
  if (!good) {
    if (is(Fault::kDamagedUsesNumber)) spoilt_.insert(head->number);
    return std::nullopt;
  }

  seen_.insert(head->number);
  if (!again && well_formed) last_heard_ = now;
  if (newest_number || is(Fault::kEchoOfTheLast) || (again && head->number == *seen_.rbegin())) {
    echo_number_ = head->number;
    echo_sent_ = body.tx_time_ns();
    echo_at_ = now;
  }
  Content content{.frames = {}, .newest = newest_number};
  for (const pb::Frame& frame : body.frames()) {
    if (within_bounds(frame) || is(Fault::kTakesAnyValue)) content.frames.push_back(frame);
    if (frame.has_bye() && !is(Fault::kTalksAfterBye)) closed = true;
  }
  return content;
}

Bytes ToySession::say(LocalTime now, const std::vector<pb::Frame>& frames) {
  pb::Datagram body;
  body.set_tx_time_ns(ns(now) + (is(Fault::kTimeGoesBack) && next_ == 2 ? 1'000'000'000 : 0));
  if (!seen_.empty()) {
    pb::Echo& echo = *body.mutable_echo();
    echo.set_peer_tx_time_ns(echo_sent_);
    echo.set_rx_time_ns(is(Fault::kEchoTimeIsNow) ? ns(now) : ns(echo_at_));
    echo.set_peer_packet_number(echo_number_);
    std::uint32_t mask = 0;
    for (auto seen = seen_.lower_bound(echo_number_); seen != seen_.begin() && *std::prev(seen) + 32 >= echo_number_;) {
      mask |= 1U << (echo_number_ - 1 - *--seen);
    }
    echo.set_received_mask(is(Fault::kEmptyMask) ? 0 : mask);
  }
  for (const pb::Frame& frame : frames) *body.add_frames() = frame;
  if (suite_ != 0 && !is(Fault::kNeverRenews) && now - renewed_ >= kKeyAge) {
    send_ = renewed(send_);
    ++send_epoch_;
    renewed_ = now;
  }
  const Bytes head = write({.version = static_cast<std::uint8_t>(is(Fault::kWrongVersion) ? 2 : 1),
                            .epoch = send_epoch_,
                            .suite = suite_,
                            .connection_id = connection_id_,
                            .number = next_});
  const Bytes text = is(Fault::kBodyIsNoMessage) && frames.empty() && next_ % 2 == 1 ? from_hex("ff") : bytes_of(body);
  Bytes sealed(text.size() + crypto::kTagSize);
  std::uint64_t number = next_;
  if (is(Fault::kLittleEndianNonce)) {
    auto bytes = little_endian(number);
    std::ranges::reverse(bytes);
    number = get_little_endian<std::uint64_t>(bytes.data());
  }
  sealing(send_).seal(number, head, text, sealed);
  next_ += is(Fault::kSkipsNumbers) && next_ == 3 ? 2 : 1;
  last_sent_ = now;
  return head + (suite_ == 0 ? text : sealed);
}

std::vector<Bytes> ToySession::say_bye(LocalTime now, pb::Code code) {
  pb::Frame bye;
  bye.mutable_bye()->set_code(code);
  std::vector<Bytes> out;
  for (int i = 0; i < (is(Fault::kOneBye) ? 1 : 3); ++i) out.push_back(say(now, {bye}));
  closed = true;
  return out;
}

bool ToySession::silent_too_long(LocalTime now) const {
  if (is(Fault::kNoKeepAlive)) return !last_sent_ || now - *last_sent_ >= seconds(1);
  return !last_sent_ || now - *last_sent_ >= milliseconds(50);
}

bool ToySession::over(LocalTime now, Duration timeout) const {
  return !is(Fault::kNoTimeout) && now - last_heard_ >= timeout;
}

}  // namespace tendon::conformance
