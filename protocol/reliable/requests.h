// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "protocol/limits.h"
#include "protocol/wire/frame.h"

// The reliable part of a session: requests arrive exactly once and in order, and each gets its answer.
//
// The requester numbers its requests 1, 2, 3 … and repeats each until its answer arrives; the answer is the
// acknowledgement. The answerer keeps its last 16 answers and repeats one whenever its request comes again. Sixteen are
// always enough: the requester has at most 16 requests open, so when request n + 16 arrives, it has the answer to n.

namespace tendon {

/// The end that asks.
class OutgoingRequests {
 public:
  /// The wait doubles with every repetition up to this, so that a request is repeated at least twice within a timeout
  /// of 2 s. The limit holds even where the round trip is longer: a request that has lost a copy on a slow link must
  /// not wait for another slow round trip, and one copy a second costs nothing.
  static constexpr Duration kMaxWait = std::chrono::seconds(1);

  /// Queues a request and returns its id; empty when kRequestWindow are open.
  std::optional<std::uint32_t> add(const Request& request);

  /// The first request that is due to be sent, or sent again; null when none is.
  const Control* next_due(LocalTime now) const noexcept { return oldest_ == next_ ? nullptr : first_due(now); }
  /// Request `id` has been sent. It is due again after `timeout`, doubled for each earlier time, at most kMaxWait.
  void sent(std::uint32_t id, LocalTime now, Duration timeout) noexcept;
  /// When the next request is due: LocalTime::min() = one was never sent, LocalTime::max() = none is open.
  LocalTime next_due_time() const noexcept { return oldest_ == next_ ? LocalTime::max() : first_due_time(); }

  /// Takes an answer. False when it answers a request that was never sent.
  bool acknowledge(const ControlAck& ack);
  /// The next answer, in the order of the requests.
  std::optional<ControlAck> next_answer();
  bool has_answer() const noexcept { return oldest_ != next_ && slot(oldest_).answer.has_value(); }

 private:
  struct Slot {
    Control control;
    LocalTime due{};
    int times_sent = 0;
    std::optional<ControlAck> answer;
  };
  Slot& slot(std::uint32_t id) noexcept { return slots_[id % limits::kRequestWindow]; }
  const Slot& slot(std::uint32_t id) const noexcept { return slots_[id % limits::kRequestWindow]; }
  const Control* first_due(LocalTime now) const noexcept;
  LocalTime first_due_time() const noexcept;

  std::array<Slot, limits::kRequestWindow> slots_;
  std::uint32_t oldest_ = 1;  ///< oldest request whose answer was not taken out
  std::uint32_t next_ = 1;    ///< id of the next request
};

/// The end that answers.
class IncomingRequests {
 public:
  /// Takes a request, in any order. The answer to one that was answered before is sent again. False when a correct peer
  /// cannot use that id yet.
  bool take(const Control& control);
  /// Returns each request exactly once, in order, or null if there is none. The request is valid until the next call of
  /// `take`. This also answers requests that are unknown or invalid.
  const Control* next();
  bool has_next() const noexcept { return slots_[next_ % limits::kRequestWindow].stage == Slot::Stage::kArrived; }
  /// Answers a request that `next` returned; any other id is ignored.
  void answer(ControlAck ack);

  /// The first answer that is due to be sent; null when none is.
  const ControlAck* next_due() const noexcept { return due_ == 0 ? nullptr : first_due(); }
  void sent(std::uint32_t id) noexcept;

 private:
  struct Slot {
    enum class Stage : std::uint8_t { kEmpty, kArrived, kTaken, kAnswered };
    Stage stage = Stage::kEmpty;
    Control control;
    ControlAck answer;
    bool due = false;
  };
  Slot& slot(std::uint32_t id) noexcept { return slots_[id % limits::kRequestWindow]; }
  void set_due(Slot& slot, bool due) noexcept;
  const ControlAck* first_due() const noexcept;

  std::array<Slot, limits::kRequestWindow> slots_;
  std::uint32_t next_ = 1;  ///< the next request to hand out
  int due_ = 0;             ///< slots with `due` set; it saves the search, which nearly every datagram would do in vain
};

}  // namespace tendon
