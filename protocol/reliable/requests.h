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
// The requester numbers its requests 1, 2, 3 … and repeats each until the answer has come; the answer is
// the acknowledgement. The answerer keeps the last 16 answers and repeats one whenever its request comes
// again. That is enough for ever: the requester has at most 16 requests open, so when request n + 16
// arrives, the answer to n has.

namespace tendon {

/// The asking end.
class OutgoingRequests {
 public:
  /// Waits double with every repetition up to this: twice within a 2 s timeout. Also where the round trip is longer:
  /// what has been slow for a while and lost a copy must not then wait for all that time; a copy a second costs
  /// nothing.
  static constexpr Duration kMaxWait = std::chrono::seconds(1);

  /// Queues a request and returns its id; empty when kRequestWindow are open.
  std::optional<std::uint32_t> add(const Request& request);

  /// The first request to be sent (again) now; null when none is.
  const Control* next_due(LocalTime now) const noexcept;
  /// It has been sent; it is due again after `timeout`, doubled for every time before, at most kMaxWait.
  void sent(std::uint32_t id, LocalTime now, Duration timeout) noexcept;
  /// When the next one is due: LocalTime::min() = it was never sent, LocalTime::max() = none.
  LocalTime next_due_time() const noexcept;

  /// Takes an answer. False when it answers what was never asked.
  bool acknowledge(const ControlAck& ack);
  /// The next answer, in the order of the requests.
  std::optional<ControlAck> next_answer();

 private:
  struct Slot {
    Control control;
    LocalTime due{};
    int times_sent = 0;
    std::optional<ControlAck> answer;
  };
  Slot& slot(std::uint32_t id) noexcept { return slots_[id % limits::kRequestWindow]; }
  const Slot& slot(std::uint32_t id) const noexcept { return slots_[id % limits::kRequestWindow]; }

  std::array<Slot, limits::kRequestWindow> slots_;
  std::uint32_t oldest_ = 1;  ///< oldest request whose answer was not taken out
  std::uint32_t next_ = 1;    ///< id of the next request
};

/// The answering end.
class IncomingRequests {
 public:
  /// Takes a request in any order. One that was answered before has its answer sent again. False when
  /// the id is one that a correct peer cannot use yet.
  bool take(const Control& control);
  /// The next request, exactly once and in order. Those this build does not know are answered here.
  std::optional<Control> next();
  /// Answers a request that `next` returned; any other id is ignored.
  void answer(ControlAck ack);

  /// The first answer to be sent now; null when none is.
  const ControlAck* next_due() const noexcept;
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

  std::array<Slot, limits::kRequestWindow> slots_;
  std::uint32_t next_ = 1;  ///< the next request to hand out
  int due_ = 0;             ///< slots that are: asked for at every datagram, and hardly ever any
};

}  // namespace tendon
