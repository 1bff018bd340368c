// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/trace.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tendon::lab {

void Extremes::observe(double value) noexcept {
  if (std::isnan(value)) return;
  if (empty()) {
    least = most = value;
  } else if (value < least) {
    least = value;
    least_first = false;
  } else if (value > most) {
    most = value;
    least_first = true;
  }
}

void Extremes::observe(const Extremes& other) noexcept {
  if (other.empty()) return;
  observe(other.first());
  observe(other.second());
}

Trace::Trace(const Config& config) : config_(config), columns_(config.columns) {
  if (config.span <= Duration::zero()) throw std::invalid_argument("a trace requires a span above zero");
  if (config.columns == 0) throw std::invalid_argument("a trace requires at least one column");
}

void Trace::observe(const StepRecord& step) {
  const Duration since = step.hand.at - config_.start;
  if (since < Duration::zero() || since > config_.span) return;
  const double place = seconds(since) / seconds(config_.span) * static_cast<double>(columns_.size());
  Column& column = columns_[std::min(static_cast<std::size_t>(place), columns_.size() - 1)];
  if (!step.reasons.has(Reason::kUnseen)) column.position.observe(step.hand.position.dot(config_.axis));
  column.wanted.observe(step.wanted.dot(config_.axis));
  column.applied.observe(step.applied.dot(config_.axis));
  if (std::isfinite(step.permitted)) column.permitted.observe(step.permitted);
  column.energy.observe(step.energy);
  column.overrun |= step.reasons.has(Reason::kOverrun);
}

double Trace::time(std::size_t column) const noexcept {
  return (static_cast<double>(column) + 0.5) * seconds(config_.span) / static_cast<double>(columns_.size());
}

}  // namespace tendon::lab
