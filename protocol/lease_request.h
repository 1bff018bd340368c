// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "protocol/session.h"

namespace tendon {

/// A controller's side of the lease of one channel (SESSION.md, "Channels and leases"). It records whether the
/// controller holds the lease and when the next request for it is due.
///
/// Thread-safe: no. Realtime-safe: no.
class LeaseRequest {
 public:
  /// After a refusal with kBusy or a loss, the next request is due after `again`, or when the server expects the lease
  /// to be free, whichever is later. If `keep_asking` is false, no request follows.
  LeaseRequest(Duration again, bool keep_asking) noexcept : again_(again), keep_asking_(keep_asking) {}

  /// Call when a session has granted this place. A controller holds the lease from the start.
  void open(const Grant& place, LocalTime now) noexcept;
  void close() noexcept;

  const Grant& place() const noexcept { return place_; }
  bool holds() const noexcept { return holds_; }
  /// When to call ask(). LocalTime::max() while a request is unanswered or none is wanted.
  LocalTime due() const noexcept { return asked_ ? LocalTime::max() : ask_at_; }
  void ask_at(LocalTime at) noexcept { ask_at_ = at; }

  /// Requests the lease, or gives it up. Returns false if the session has too many open requests.
  bool ask(Session& session);
  bool give(Session& session);

  /// Handles the answer to the newest request and returns true. Returns false for any other answer.
  bool take(const Session::RequestAnswered& answer, LocalTime now) noexcept;
  /// Handles the loss of the lease to another controller. Returns false if it concerns another channel.
  bool take(const LeaseLost& lost, Session& session, LocalTime now);

 private:
  Duration again_;
  bool keep_asking_;
  Grant place_{};
  bool holds_ = false;
  std::optional<std::uint32_t> asked_;  ///< id of the unanswered request
  LocalTime ask_at_ = LocalTime::max();
};

}  // namespace tendon
