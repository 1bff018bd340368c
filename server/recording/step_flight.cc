// SPDX-License-Identifier: Apache-2.0
#include "server/recording/step_flight.h"

#include <sys/mman.h>

#include <algorithm>
#include <new>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr std::size_t kChunk = 4096;  ///< bytes, one page
/// Number of chunks to load in advance. Half of them hold 40 steps without a handle.
constexpr std::size_t kAhead = 8;
constexpr std::size_t kMostSteps = 65536;

std::byte* reserve(std::size_t bytes) {
  void* const memory =
      ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  ::madvise(memory, bytes, MADV_NOHUGEPAGE);  // it would load 512 pages for one
  return static_cast<std::byte*>(memory);
}

std::size_t chunks_for(std::size_t capacity, std::size_t most) {
  expect(capacity >= 1 && capacity <= kMostSteps, "capacity", static_cast<double>(capacity), "1 to 65536 steps");
  const std::size_t in_a_chunk = kChunk / most;
  return (capacity + in_a_chunk - 1) / in_a_chunk + 2;  // two chunks can be incomplete
}

}  // namespace

void StepFlight::Unmap::operator()(std::byte* memory) const noexcept { ::munmap(memory, bytes); }

StepFlight::StepFlight(std::size_t capacity, bool handles, bool fields)
    : capacity_(capacity),
      handles_(handles),
      fields_(fields),
      most_(most_packed_bytes(handles, fields)),
      chunks_(chunks_for(capacity, most_)),
      memory_(reserve(chunks_ * kChunk), Unmap{chunks_ * kChunk}),
      first_(chunks_),
      order_(chunks_) {
  free_.reserve(chunks_);
  make_ready();
}

std::span<std::byte> StepFlight::memory_of(std::size_t first, std::size_t end) const noexcept {
  return {memory_.get() + first * kChunk, (end - first) * kChunk};
}

void StepFlight::make_ready() noexcept {
  const std::size_t used = used_.load(std::memory_order_relaxed);
  if (ready_ >= std::min(used + kAhead / 2, chunks_)) return;
  const std::size_t enough = std::min(used + kAhead, chunks_);
  const std::span<std::byte> next = memory_of(ready_, enough);
  // Linux supports this since 5.14.
  if (::madvise(next.data(), next.size(), MADV_POPULATE_WRITE) != 0) ::mlock(next.data(), next.size());
  ready_ = enough;
}

void StepFlight::begin_chunk() noexcept {
  while (newest_ - oldest_ >= 2 && first_[in_order(oldest_ + 1)] + capacity_ <= count_ + 1) {
    free_.push_back(in_order(oldest_++));
  }
  std::uint16_t next = 0;
  if (free_.empty()) {
    const std::size_t used = used_.load(std::memory_order_relaxed);
    next = static_cast<std::uint16_t>(used);
    used_.store(used + 1, std::memory_order_relaxed);
  } else {
    next = free_.back();
    free_.pop_back();
  }
  order_[newest_++ % order_.size()] = next;
  first_[next] = count_;
  at_ = chunk(next);
  end_ = at_ + kChunk;
  before_ = {};
}

std::byte* StepFlight::chunk(std::uint16_t number) const noexcept { return memory_of(number, number).data(); }

void StepFlight::record(const StepRecord& step) noexcept {
  if (frozen()) return;
  if ((step.handle && !handles_) || (step.field && !fields_)) return record_without(step);
  if (static_cast<std::size_t>(end_ - at_) < most_) begin_chunk();
  at_ = pack_step(step, before_, at_);
  ++count_;
}

void StepFlight::record_without(StepRecord step) noexcept {
  if (!handles_) step.handle.reset();
  if (!fields_) step.field.reset();
  record(step);
}

void StepFlight::thaw() noexcept {
  while (oldest_ != newest_) free_.push_back(in_order(oldest_++));
  count_ = 0;
  at_ = end_ = nullptr;
  frozen_.store(false, std::memory_order_release);
}

StepRecord StepFlight::operator[](std::size_t i) const noexcept {
  const std::uint64_t number = count_ - size() + i;
  std::size_t from = newest_ - 1;
  while (first_[in_order(from)] > number) --from;
  const std::byte* at = chunk(in_order(from));
  StepBefore before;
  for (std::uint64_t of = first_[in_order(from)];; ++of) {
    StepRecord step;
    at = unpack_step(at, before, step);
    if (of == number) return step;
  }
}

std::size_t StepFlight::used_bytes() const noexcept { return used_.load(std::memory_order_relaxed) * kChunk; }

}  // namespace tendon
