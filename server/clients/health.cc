// SPDX-License-Identifier: Apache-2.0
#include "server/clients/health.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

namespace tendon {

HealthMeter::HealthMeter(Duration period) : period_(period) {
  if (period <= Duration::zero()) throw std::invalid_argument("period must be above zero");
}

void HealthMeter::observe(const StepRecord& step) noexcept {
  const Duration since = before_ ? step.scheduled - *before_ : period_;
  if (since >= 2 * period_) missed_.set(missed_.value() + static_cast<std::uint64_t>(since / period_ - 1));
  before_ = step.scheduled;
  if (step.reasons.has(Reason::kOverrun)) overruns_.add();
  if (step.reasons.has(Reason::kUnseen)) unseen_.add();
  if (step.reasons.has(Reason::kAcceleration)) broken_assumptions_.add();
  lateness_[lateness_bucket(step.hand.at - step.scheduled)].add();
}

Health HealthMeter::counted() const noexcept {
  Health health;
  for (std::size_t i = 0; i < lateness_.size(); ++i) health.lateness[i] = lateness_[i].value();
  health.steps = std::accumulate(health.lateness.begin(), health.lateness.end(), std::uint64_t{0});
  health.missed = missed_.value();
  health.overruns = overruns_.value();
  health.unseen = unseen_.value();
  health.broken_assumptions = broken_assumptions_.value();
  return health;
}

DeviceReport report(const Health& before, const Health& now) {
  DeviceReport report;
  report.until = PeerTime(now.at.time_since_epoch());  // our clock is the peer clock of the client
  report.span = now.at - before.at;
  report.steps = now.steps - before.steps;
  report.missed = now.missed - before.missed;
  report.overruns = now.overruns - before.overruns;
  report.unseen = now.unseen - before.unseen;
  for (std::size_t i = 0; i < report.lateness.size(); ++i) report.lateness[i] = now.lateness[i] - before.lateness[i];
  report.safety = now.safety;
  report.fault = now.fault;

  const auto say = [&](bool true_now, std::string_view words) {
    if (true_now) report.degraded += (report.degraded.empty() ? "" : "; ") + std::string(words);
  };
  // These texts are short because of limits::kMaxDetail.
  say(now.not_realtime, "no real time");
  say(now.steps_lost > before.steps_lost, "the log thread is too slow");
  say(now.recording_ended, "recording has stopped");
  say(now.unsent > before.unsent, "unsent datagrams");
  say(now.broken_assumptions > before.broken_assumptions, "acceleration too high");
  const auto worst = std::ranges::find_if(kDeviceCounters, [&](const DeviceCounter& row) {
    return !row.degraded.empty() && now.device[row.count] > before.device[row.count];
  });
  if (worst != kDeviceCounters.end()) say(true, worst->degraded);
  return report;
}

}  // namespace tendon
