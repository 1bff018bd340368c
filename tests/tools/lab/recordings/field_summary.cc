// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/recordings/field_summary.h"

#include <chrono>

#include "core/base/reason.h"

namespace tendon::lab {

void FieldObserver::observe(const StepRecord& step) {
  constexpr Duration kAfterSwap = std::chrono::milliseconds(200);
  constexpr double kRounding = 1e-9;  // J
  if (!step.reasons.has(Reason::kUnseen)) observe_use(step);
  if (swapped_ && last_at_ && step.hand.at > *last_at_ && step.hand.at - *swapped_ <= kAfterSwap) {
    const double slew = (step.applied - last_applied_).norm() / seconds(step.hand.at - *last_at_);
    so_far_.swap_slew = std::max(so_far_.swap_slew.value_or(0), slew);
  }
  last_at_ = step.hand.at;
  last_applied_ = step.applied;
  if (!step.field) return;
  ++so_far_.steps;
  so_far_.contact_steps += step.field->depth > 0 ? 1 : 0;
  so_far_.refused_steps += step.field->refused > kRounding ? 1 : 0;
  so_far_.refused += step.field->refused;
  so_far_.credit += step.field->credit;
  so_far_.largest_stored = std::max(so_far_.largest_stored, step.field->stored);
  so_far_.least_account = std::min(so_far_.least_account, step.energy);
}

void FieldObserver::observe_use(const StepRecord& step) {
  if (!step.field) {
    generations_.clear();
    return;
  }
  const auto [in_use, started] = generations_.try_emplace(step.field->channel, step.field->generation);
  const bool swapped = in_use->second != step.field->generation;
  in_use->second = step.field->generation;
  so_far_.used += started || swapped ? 1 : 0;
  so_far_.swaps += swapped ? 1 : 0;
  if (swapped) swapped_ = step.hand.at;
}

std::optional<FieldSummary> FieldObserver::summary() const {
  return so_far_.steps > 0 ? std::optional(so_far_) : std::nullopt;
}

}  // namespace tendon::lab
