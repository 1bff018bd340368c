// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"
#include "protocol/limits.h"
#include "protocol/wire/frame.h"

// The reliable part of a session (SESSION.md, "Requests").

namespace tendon {

class OutgoingRequests {
 public:
  /// The delay before a copy of a request starts with `timeout`, is doubled for each copy, and is limited to this
  /// value. At least two copies are sent within the session timeout of 2 s, even if the round trip is longer.
  static constexpr Duration kMaxWait = std::chrono::seconds(1);

  std::optional<std::uint32_t> add(const Request& request);  ///< nullopt if kRequestWindow requests are pending

  /// Returns the first request that must be sent or resent, or null.
  const Control* next_due(LocalTime now) const noexcept { return oldest_ == next_ ? nullptr : first_due(now); }
  /// Must be called after sending a request. Sets the time for the next copy (see kMaxWait).
  void sent(std::uint32_t id, LocalTime now, Duration timeout) noexcept;
  /// LocalTime::min() if a request was not sent yet, LocalTime::max() if all are answered.
  LocalTime next_due_time() const noexcept { return oldest_ == next_ ? LocalTime::max() : first_due_time(); }

  bool acknowledge(const ControlAck& ack);  ///< false if the request was not sent
  /// Returns the answers in the order of the requests.
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
  std::uint32_t oldest_ = 1;  ///< oldest request without a returned answer
  std::uint32_t next_ = 1;
};

class IncomingRequests {
 public:
  /// In any order. Resends the answer to an earlier request. Returns false if a correct peer could not use this id.
  bool take(const Control& control);
  /// Returns each request once and in order, or null; valid until `take`. Answers unknown and invalid ones itself.
  const Control* next();
  bool has_next() const noexcept { return slots_[next_ % limits::kRequestWindow].stage == Slot::Stage::kArrived; }
  void answer(ControlAck ack);  ///< ignores ids that were not returned by `next`

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
  std::uint32_t next_ = 1;
  int due_ = 0;  ///< number of slots with `due`, to avoid searching
};

}  // namespace tendon
