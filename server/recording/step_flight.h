// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>

#include "core/exchange/flight_recorder.h"
#include "server/recording/records.h"

namespace tendon {

/// Stores the last steps of a device before a fault. The handles and the fields of the steps are optional, because a
/// handle needs half of the memory of a StepRecord. Thread-safe, Realtime-safe: see FlightRecorder.
class StepFlight {
 public:
  /// `capacity` must be a power of two.
  explicit StepFlight(std::size_t capacity, bool handles = true, bool fields = true) : steps_(capacity) {
    if (handles) handles_.emplace(capacity);
    if (fields) fields_.emplace(capacity);
  }

  void record(const StepRecord& step) {
    steps_.record(step);
    if (handles_) handles_->record(step.handle);
    if (fields_) fields_->record(step.field);
  }

  /// In this order, because the other thread only checks the recorder of the steps.
  void freeze() noexcept {
    if (handles_) handles_->freeze();
    if (fields_) fields_->freeze();
    steps_.freeze();
  }
  bool frozen() const noexcept { return steps_.frozen(); }
  void thaw() noexcept {
    if (handles_) handles_->thaw();
    if (fields_) fields_->thaw();
    steps_.thaw();
  }

  std::size_t size() const noexcept { return steps_.size(); }
  StepRecord operator[](std::size_t i) const noexcept {
    StepRecord step;
    static_cast<PositionStep&>(step) = steps_[i];
    static_cast<LoopStep&>(step) = steps_[i];
    if (handles_) step.handle = (*handles_)[i];
    if (fields_) step.field = (*fields_)[i];
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
  std::optional<FlightRecorder<std::optional<FieldStep>>> fields_;
};

}  // namespace tendon
