// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "protocol/limits.h"
#include "protocol/wire/frame.h"

// The reliable part of a session. Requests arrive exactly once and in order, and each one is answered.
//
// The requester numbers its requests 1, 2, 3 … and repeats each one until its answer arrives; the answer is the
// acknowledgment. The responder keeps its last 16 answers and repeats one when its request arrives again. Sixteen are
// enough, because the requester has at most 16 open requests: when request n + 16 arrives, it has received the answer
// to n.

namespace tendon {

/// The requester.
class OutgoingRequests {
 public:
  /// Longest time between repetitions. The time doubles up to this value, so that a request is repeated at least twice
  /// within a timeout of 2 s. It applies even if the round trip is longer: on a slow link, a lost copy should not cost
  /// another round trip, and one copy per second is cheap.
  static constexpr Duration kMaxWait = std::chrono::seconds(1);

  /// Queues a request and returns its id, or nullopt if kRequestWindow requests are open.
  std::optional<std::uint32_t> add(const Request& request);

  /// The first request that must be sent or resent now, or null.
  const Control* next_due(LocalTime now) const noexcept { return oldest_ == next_ ? nullptr : first_due(now); }
  /// Records that request `id` was sent. It is due again after `timeout`, which doubles with every repetition up to
  /// kMaxWait.
  void sent(std::uint32_t id, LocalTime now, Duration timeout) noexcept;
  /// When the next request is due. LocalTime::min() if one was never sent, LocalTime::max() if none is open.
  LocalTime next_due_time() const noexcept { return oldest_ == next_ ? LocalTime::max() : first_due_time(); }

  /// Handles an answer. Returns false if that request was never sent.
  bool acknowledge(const ControlAck& ack);
  /// Returns the next answer, in the order of the requests.
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
  std::uint32_t oldest_ = 1;  ///< oldest request whose answer was not taken
  std::uint32_t next_ = 1;    ///< id of the next request
};

/// The responder.
class IncomingRequests {
 public:
  /// Handles a request; they may arrive in any order. If it was answered before, the answer is sent again. Returns
  /// false if a correct peer could not use that id yet.
  bool take(const Control& control);
  /// Returns each request exactly once and in order, or null if there is none. It is valid until the next call of
  /// `take`. Unknown and invalid requests are answered here and skipped.
  const Control* next();
  bool has_next() const noexcept { return slots_[next_ % limits::kRequestWindow].stage == Slot::Stage::kArrived; }
  /// Answers a request that was returned by `next`. Other ids are ignored.
  void answer(ControlAck ack);

  /// The first answer that must be sent now, or null.
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
  std::uint32_t next_ = 1;  ///< id of the next request to return
  int due_ = 0;             ///< number of slots with `due` set; avoids a search that nearly always finds nothing
};

}  // namespace tendon
