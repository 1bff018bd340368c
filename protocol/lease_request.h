// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "protocol/session.h"

namespace tendon {

/// The controller's side of the lease of one channel (SESSION.md, "Channels and leases").
/// Thread-safe: no. Realtime-safe: no.
class LeaseRequest {
 public:
  /// If `keep_asking` is true, another request is due after a loss or a refusal with kBusy. The delay is `again`, or
  /// the time until the server expects the lease to be free if this is longer.
  LeaseRequest(Duration again, bool keep_asking) noexcept : again_(again), keep_asking_(keep_asking) {}

  /// A controller holds the lease from the start of a session.
  void open(const Grant& place, LocalTime now) noexcept;
  void close() noexcept;

  const Grant& place() const noexcept { return place_; }
  bool holds() const noexcept { return holds_; }
  /// When to call ask(). LocalTime::max() if a request is pending or not wanted.
  LocalTime due() const noexcept { return asked_ ? LocalTime::max() : ask_at_; }
  void ask_at(LocalTime at) noexcept { ask_at_ = at; }

  /// Both return false if the session has too many pending requests.
  bool ask(Session& session);
  bool give(Session& session);

  /// Returns false if this is not the answer to the newest request.
  bool take(const Session::RequestAnswered& answer, LocalTime now) noexcept;
  /// Returns false if this is the lease of another channel.
  bool take(const LeaseLost& lost, Session& session, LocalTime now);

 private:
  Duration again_;
  bool keep_asking_;
  Grant place_{};
  bool holds_ = false;
  std::optional<std::uint32_t> asked_;
  LocalTime ask_at_ = LocalTime::max();
};

}  // namespace tendon
