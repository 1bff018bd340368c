// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "protocol/session.h"

namespace tendon {

/// A controller's side of the lease of one channel (SESSION.md, "Channels and leases"): whether this end holds the lease, and when it
/// asks for it.
///
/// Thread-safe: no. Realtime-safe: no.
class LeaseRequest {
 public:
  /// After a refusal with kBusy and after a loss, the next request is due `again` later, or when the server expects the
  /// lease to be free, whichever is later. If `keep_asking` is false, none is due.
  LeaseRequest(Duration again, bool keep_asking) noexcept : again_(again), keep_asking_(keep_asking) {}

  /// A session has granted this place. A controller holds the lease from the start.
  void open(const Grant& place, LocalTime now) noexcept;
  /// The session has ended.
  void close() noexcept;

  const Grant& place() const noexcept { return place_; }
  bool holds() const noexcept { return holds_; }
  /// When to call ask(). LocalTime::max() while a request waits for its answer, and when none is wanted.
  LocalTime due() const noexcept { return asked_ ? LocalTime::max() : ask_at_; }
  void ask_at(LocalTime at) noexcept { ask_at_ = at; }

  /// Sends a request for the lease, or gives the lease up. False if too many requests of the session are open.
  bool ask(Session& session);
  bool give(Session& session);

  /// Takes the answer to the newest request and returns true. Returns false for any other answer.
  bool take(const Session::RequestAnswered& answer, LocalTime now) noexcept;
  /// Another controller has taken the lease. False if it is the lease of another channel.
  bool take(const LeaseLost& lost, Session& session, LocalTime now);

 private:
  Duration again_;
  bool keep_asking_;
  Grant place_{};
  bool holds_ = false;
  std::optional<std::uint32_t> asked_;  ///< the request that waits for its answer
  LocalTime ask_at_ = LocalTime::max();
};

}  // namespace tendon
