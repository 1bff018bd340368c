// SPDX-License-Identifier: Apache-2.0
#include "server/guests/health.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <string>

namespace tendon {

HealthMeter::HealthMeter(Duration period) : period_(period) {
  if (period <= Duration::zero()) throw std::invalid_argument("period must be above zero");
}

void HealthMeter::observe(const StepRecord& step) noexcept {
  if (before_) {
    const std::int64_t periods = (step.scheduled - before_->scheduled) / period_;
    const auto steps = static_cast<std::int64_t>(step.tick - before_->tick);
    if (periods > steps) counted_.missed += static_cast<std::uint64_t>(periods - steps);
  }
  before_ = {step.tick, step.scheduled};
  counted_.steps = step.tick;
  counted_.overruns += step.reasons.has(Reason::kOverrun) ? 1 : 0;
  counted_.unseen += step.reasons.has(Reason::kUnseen) ? 1 : 0;
  counted_.broken_assumptions += step.reasons.has(Reason::kAcceleration) ? 1 : 0;
  ++counted_.lateness[lateness_bucket(step.hand.at - step.scheduled)];
}

DeviceReport report(const Health& before, const Health& now) {
  DeviceReport report;
  report.until = PeerTime(now.at.time_since_epoch());  // our clock is the client's peer's
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
  const auto counted = std::accumulate(report.lateness.begin(), report.lateness.end(), std::uint64_t{0});
  // Short, so that the sentences fit (limits::kMaxDetail).
  say(now.not_realtime, "no real time");
  say(counted < report.steps, "the log thread does not follow");
  say(now.recording_ended, "recording has stopped");
  say(now.unsent > before.unsent, "unsent datagrams");
  // The hand accelerated more than limiter.bounded_acceleration allows.
  say(now.broken_assumptions > before.broken_assumptions, "accelerates too hard");
  const auto worst = std::ranges::find_if(kDeviceCounters, [&](const DeviceCounter& row) {
    return !row.degraded.empty() && now.device[row.count] > before.device[row.count];
  });
  if (worst != kDeviceCounters.end()) say(true, worst->degraded);
  return report;
}

}  // namespace tendon
