// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/recording/packed_step.h"

namespace tendon {

/// Stores the last steps before a fault. If it is frozen, another thread can read them. Steps are packed into chunks of
/// one page, which are reused when their steps are too old. The amount of memory depends on how many values change. The
/// constructor reserves addresses for the maximum size, but it only loads the first pages.
/// Thread-safe: one thread can call `record` and `freeze`, and another one `make_ready`. While it is frozen, the other
/// thread can read it and call `thaw`. Realtime-safe: `record` and `freeze`.
class StepFlight {
 public:
  /// Keeps the last `capacity` steps. The handles and the fields of the steps are optional. Throws
  /// std::invalid_argument if the capacity is 0 or above 65536, and std::bad_alloc.
  explicit StepFlight(std::size_t capacity, bool handles = true, bool fields = true);

  /// Does nothing while frozen.
  void record(const StepRecord& step) noexcept;

  void freeze() noexcept { frozen_.store(true, std::memory_order_release); }
  bool frozen() const noexcept { return frozen_.load(std::memory_order_acquire); }
  void thaw() noexcept;  ///< removes all steps and resumes recording

  /// Loads the next pages. If this is not called every 40 ms, no steps are lost, but `record` can cause page faults.
  void make_ready() noexcept;

  /// Must be frozen, or called from the recording thread. This is also true for operator[].
  std::size_t size() const noexcept { return count_ < capacity_ ? count_ : capacity_; }
  StepRecord operator[](std::size_t i) const noexcept;  ///< the i-th oldest step, i < size()

  std::size_t used_bytes() const noexcept;

 private:
  struct Unmap {
    std::size_t bytes = 0;
    void operator()(std::byte* memory) const noexcept;
  };

  std::byte* chunk(std::uint16_t number) const noexcept;
  std::span<std::byte> memory_of(std::size_t first, std::size_t end) const noexcept;
  std::uint16_t in_order(std::size_t i) const noexcept { return order_[i % order_.size()]; }
  void begin_chunk() noexcept;
  void record_without(StepRecord step) noexcept;  ///< removes parts

  std::size_t capacity_;
  bool handles_;
  bool fields_;
  std::size_t most_;    ///< maximum size of a packed step
  std::size_t chunks_;  ///< enough for `capacity_` of the largest steps
  std::unique_ptr<std::byte, Unmap> memory_;
  std::vector<std::uint64_t> first_;  ///< number of the first step, for each chunk
  std::vector<std::uint16_t> order_;  ///< ring of the chunks with steps, from oldest_ to newest_
  std::vector<std::uint16_t> free_;   ///< used before, without steps
  std::size_t oldest_ = 0;
  std::size_t newest_ = 0;  ///< after the last one
  std::size_t ready_ = 0;   ///< chunks in memory
  std::atomic<std::size_t> used_{0};
  std::uint64_t count_ = 0;  ///< number of steps
  std::byte* at_ = nullptr;
  std::byte* end_ = nullptr;  ///< of the chunk
  StepBefore before_;
  std::atomic<bool> frozen_{false};
};

}  // namespace tendon
