// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "core/exchange/flight_recorder.h"
#include "server/recording/records.h"

namespace tendon {

/// The last steps of a device, for when a fault comes: FlightRecorder, in which a device that has a position only pays
/// for no handle. That is half of a StepRecord.
///
/// Thread-safe and Realtime-safe: as FlightRecorder.
class StepFlight {
 public:
  /// Keeps the last `capacity` steps, a power of two. Without `handles` those of the steps are left out.
  explicit StepFlight(std::size_t capacity, bool handles = true) : steps_(capacity) {
    if (handles) handles_.emplace(capacity);
  }

  void record(const StepRecord& step) {
    steps_.record(step);
    if (handles_) handles_->record(step.handle);
  }

  /// Both at once for the other thread, which looks at the one of the steps.
  void freeze() noexcept {
    if (handles_) handles_->freeze();
    steps_.freeze();
  }
  bool frozen() const noexcept { return steps_.frozen(); }
  void thaw() noexcept {
    if (handles_) handles_->thaw();
    steps_.thaw();
  }

  std::size_t size() const noexcept { return steps_.size(); }
  StepRecord operator[](std::size_t i) const noexcept {
    StepRecord step;
    static_cast<PositionStep&>(step) = steps_[i];
    static_cast<LoopStep&>(step) = steps_[i];
    if (handles_) step.handle = (*handles_)[i];
    return step;
  }

 private:
  struct Kept : PositionStep, LoopStep {
    Kept& operator=(const StepRecord& step) {
      PositionStep::operator=(step);
      LoopStep::operator=(step);
      return *this;
    }
  };

  FlightRecorder<Kept> steps_;
  std::optional<FlightRecorder<std::optional<HandleStep>>> handles_;
};

}  // namespace tendon
