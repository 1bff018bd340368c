// SPDX-License-Identifier: Apache-2.0
#include "protocol/reliable/requests.h"

#include <algorithm>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

namespace tendon {

std::optional<std::uint32_t> OutgoingRequests::add(const Request& request) {
  // The ids are sufficient for 136 years at one request per second.
  if (next_ - oldest_ == limits::kRequestWindow || next_ == std::numeric_limits<std::uint32_t>::max()) return {};
  slot(next_) = {.control = {.id = next_, .request = request}, .due = LocalTime::min(), .times_sent = 0, .answer = {}};
  return next_++;
}

const Control* OutgoingRequests::first_due(LocalTime now) const noexcept {
  for (std::uint32_t id = oldest_; id != next_; ++id) {
    if (!slot(id).answer && slot(id).due <= now) return &slot(id).control;
  }
  return nullptr;
}

void OutgoingRequests::sent(std::uint32_t id, LocalTime now, Duration timeout) noexcept {
  Slot& sent = slot(id);
  Duration wait = timeout;
  for (int i = 0; i < sent.times_sent && wait < kMaxWait; ++i) wait *= 2;
  sent.due = now + std::min(wait, kMaxWait);
  ++sent.times_sent;
}

LocalTime OutgoingRequests::first_due_time() const noexcept {
  LocalTime next = LocalTime::max();
  for (std::uint32_t id = oldest_; id != next_; ++id) {
    if (!slot(id).answer) next = std::min(next, slot(id).due);
  }
  return next;
}

bool OutgoingRequests::acknowledge(const ControlAck& ack) {
  if (ack.id >= next_) return false;
  if (ack.id < oldest_) return true;
  Slot& asked = slot(ack.id);
  if (asked.times_sent == 0) return false;
  if (!asked.answer) asked.answer = ack;
  return true;
}

std::optional<ControlAck> OutgoingRequests::next_answer() {
  if (!has_answer()) return {};
  return std::exchange(slot(oldest_++).answer, std::nullopt);
}

bool IncomingRequests::take(const Control& control) {
  Slot& mine = slot(control.id);
  if (control.id < next_) {
    // If the slot already contains a newer request, this is a late copy.
    if (mine.control.id == control.id && mine.stage == Slot::Stage::kAnswered) set_due(mine, true);
    return true;
  }
  if (control.id - next_ >= limits::kRequestWindow) return false;
  if (mine.stage == Slot::Stage::kTaken) return false;  // request n − 16 is not answered yet
  set_due(mine, false);
  mine = {.stage = Slot::Stage::kArrived, .control = control, .answer = {}, .due = false};
  return true;
}

const Control* IncomingRequests::next() {
  while (has_next()) {
    Slot& mine = slot(next_++);
    mine.stage = Slot::Stage::kTaken;
    if (mine.control.request) return &mine.control;
    const std::string_view field = mine.control.invalid;
    if (field.empty()) {
      answer({mine.control.id, Code::kUnsupported, "this version does not support this request"});
    } else {
      answer({mine.control.id, Code::kInvalid, std::string(field) + " is out of bounds"});
    }
  }
  return nullptr;
}

void IncomingRequests::answer(ControlAck ack) {
  Slot& mine = slot(ack.id);
  if (mine.control.id != ack.id || mine.stage != Slot::Stage::kTaken) return;
  mine.stage = Slot::Stage::kAnswered;
  mine.answer = std::move(ack);
  set_due(mine, true);
}

void IncomingRequests::set_due(Slot& slot, bool due) noexcept {
  due_ += (due ? 1 : 0) - (slot.due ? 1 : 0);
  slot.due = due;
}

const ControlAck* IncomingRequests::first_due() const noexcept {
  const auto due = std::find_if(slots_.begin(), slots_.end(), [](const Slot& slot) { return slot.due; });
  return due == slots_.end() ? nullptr : &due->answer;
}

void IncomingRequests::sent(std::uint32_t id) noexcept { set_due(slot(id), false); }

}  // namespace tendon
