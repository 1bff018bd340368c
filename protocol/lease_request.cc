// SPDX-License-Identifier: Apache-2.0
#include "protocol/lease_request.h"

#include <algorithm>

namespace tendon {

void LeaseRequest::open(const Grant& place, LocalTime now) noexcept {
  close();
  place_ = place;
  holds_ = place.role == Role::kController;
  if (!holds_ && keep_asking_) ask_at_ = now;
}

void LeaseRequest::close() noexcept {
  holds_ = false;
  asked_.reset();
  ask_at_ = LocalTime::max();
}

bool LeaseRequest::ask(Session& session) {
  asked_ = session.request(TakeLease{.device = place_.device, .channel = place_.channel});
  return asked_.has_value();
}

bool LeaseRequest::give(Session& session) {
  ask_at_ = LocalTime::max();
  if (!session.request(GiveLease{.device = place_.device, .channel = place_.channel})) return false;
  asked_.reset();  // a later answer would precede this request
  holds_ = false;
  return true;
}

bool LeaseRequest::take(const Session::RequestAnswered& answer, LocalTime now) noexcept {
  if (answer.id != asked_) return false;
  asked_.reset();
  ask_at_ = LocalTime::max();
  if (answer.code != Code::kUnsupported) holds_ = answer.code == Code::kOk;  // the server does not support leases
  if (!holds_ && keep_asking_ && answer.code == Code::kBusy) ask_at_ = now + std::max(answer.wait, again_);
  return true;
}

bool LeaseRequest::take(const LeaseLost& lost, Session& session, LocalTime now) {
  if (lost.device != place_.device || lost.channel != place_.channel) return false;
  holds_ = false;
  // The answer to an earlier request can still arrive after this message, so ask again.
  if (asked_ && ask(session)) return true;
  if (keep_asking_) ask_at_ = now + again_;
  return true;
}

}  // namespace tendon
