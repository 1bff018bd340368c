// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/injector/injector.h"

namespace tendon::injector {

/// The most recent datagrams of one flow, for stale replays. It copies every datagram. Thread-safe: no.
class History {
 public:
  static constexpr std::size_t kDepth = kMaxReplayDepth;

  void remember(std::span<const std::byte> datagram) {
    auto& place = ring_[count_++ % kDepth];
    place.assign(datagram.begin(), datagram.end());
  }

  /// Returns the datagram added `back` calls ago (1 is the newest), or nullopt if it is not available.
  std::optional<std::span<const std::byte>> back(std::size_t back) const {
    if (back == 0 || back > kDepth || back > count_) return std::nullopt;
    return ring_[(count_ - back) % kDepth];
  }

 private:
  std::array<std::vector<std::byte>, kDepth> ring_;
  std::size_t count_ = 0;
};

enum class Copy : std::uint8_t {
  kFirst,  ///< the datagram itself, with the damage of the decision
  kSecond,
  kStale,  ///< an earlier datagram, undamaged, even if it was lost
};

/// The datagrams in flight, ordered by due time and then by launch. Applies a Decision: copies, stale replays,
/// truncation and bit flips. `Tag` is data of the sender. Does not allocate in the steady state, because it reuses
/// slots and buffers (powers of two, 64 bytes … 64 kB). Thread-safe: no.
template <class Tag>
class Flight {
 public:
  /// 64 MB suffice for the longest delay (60 s) at 1 kHz in both directions with 400-byte datagrams.
  static constexpr std::size_t kDefaultMaxBytes = std::size_t{64} << 20;

  /// `max_bytes` limits buffers and bookkeeping of the datagrams in flight.
  explicit Flight(std::size_t max_bytes = kDefaultMaxBytes) : max_bytes_(max_bytes) {}

  /// `history`: of the datagram's flow; null disables stale replays. Omits a copy that exceeds the memory limit.
  /// Returns false if the datagram itself exceeded it.
  bool launch(const Decision& decision, std::span<const std::byte> datagram, const Tag& tag,
              History* history = nullptr) {
    bool fits = true;
    if (decision.verdict != Verdict::kDrop) {
      const std::size_t size = std::min<std::size_t>(datagram.size(), decision.truncated_to.value_or(UINT32_MAX));
      std::byte* const bytes = take_off(datagram.first(size), decision.release, Copy::kFirst, tag);
      fits = bytes != nullptr;
      // The bit can be missing after truncation, or if a recorded decision meets a shorter datagram.
      if (fits && decision.flipped_bit && *decision.flipped_bit / 8 < size) {
        bytes[*decision.flipped_bit / 8] ^= std::byte{1} << (*decision.flipped_bit % 8);
      }
      if (decision.duplicate) take_off(datagram, *decision.duplicate, Copy::kSecond, tag);
    }
    if (history != nullptr) {
      const auto old = decision.stale ? history->back(decision.stale->back) : std::nullopt;
      if (old) take_off(*old, decision.stale->release, Copy::kStale, tag);
      history->remember(datagram);
    }
    return fits;
  }

  struct Departure {
    Tag tag;
    Copy copy{};
    LocalTime due{};
    std::span<const std::byte> datagram;  ///< valid until the next launch
  };
  std::optional<Departure> next_due(LocalTime now) {
    if (heap_.empty() || heap_.front().due > now) return std::nullopt;
    const Waiting next = heap_.front();
    std::pop_heap(heap_.begin(), heap_.end(), later);
    heap_.pop_back();
    Place& place = places_[next.place];
    free_places_.push_back(next.place);
    bytes_ -= cost(place.size_class);
    Departure departure{place.tag, place.copy, next.due, {place.buffer.get(), place.size}};
    // The bytes stay valid until a launch reuses this buffer.
    free_buffers_[place.size_class].push_back(std::move(place.buffer));
    return departure;
  }

  std::optional<LocalTime> next_wake() const {
    if (heap_.empty()) return std::nullopt;
    return heap_.front().due;
  }

  std::size_t size() const noexcept { return heap_.size(); }
  std::size_t bytes() const noexcept { return bytes_; }

 private:
  using Buffer = std::unique_ptr<std::byte[]>;
  static constexpr std::size_t kSmallestBuffer = 64;
  static constexpr std::size_t kSizeClasses = 11;  // 64 bytes … 64 kB, above the maximum size of a UDP datagram

  struct Place {
    Tag tag{};
    Buffer buffer;
    std::uint32_t size = 0;
    std::uint8_t size_class = 0;
    Copy copy{};
  };
  struct Waiting {
    LocalTime due;
    std::uint64_t launched;
    std::uint32_t place;
  };
  static bool later(const Waiting& a, const Waiting& b) noexcept {
    return a.due != b.due ? a.due > b.due : a.launched > b.launched;
  }

  static std::uint8_t size_class_of(std::size_t size) noexcept {
    return static_cast<std::uint8_t>(std::bit_width((std::max(size, kSmallestBuffer) - 1) / kSmallestBuffer));
  }
  static constexpr std::size_t cost(std::size_t size_class) noexcept {
    return (kSmallestBuffer << size_class) + sizeof(Place) + sizeof(Waiting);
  }

  std::byte* take_off(std::span<const std::byte> datagram, LocalTime due, Copy copy, const Tag& tag) {
    const std::uint8_t size_class = size_class_of(datagram.size());
    if (size_class >= kSizeClasses || cost(size_class) > max_bytes_ - bytes_) return nullptr;
    bytes_ += cost(size_class);
    if (free_places_.empty()) {
      free_places_.push_back(static_cast<std::uint32_t>(places_.size()));
      places_.emplace_back();
    }
    const std::uint32_t index = free_places_.back();
    free_places_.pop_back();
    Place& place = places_[index];
    place.tag = tag;
    place.copy = copy;
    place.buffer = buffer_of(size_class);
    place.size = static_cast<std::uint32_t>(datagram.size());
    place.size_class = size_class;
    if (!datagram.empty()) std::memcpy(place.buffer.get(), datagram.data(), datagram.size());
    heap_.push_back({due, launched_++, index});
    std::push_heap(heap_.begin(), heap_.end(), later);
    return place.buffer.get();
  }

  Buffer buffer_of(std::uint8_t size_class) {
    auto& free = free_buffers_[size_class];
    if (free.empty()) {
      const std::size_t size = kSmallestBuffer << size_class;
      if (size > max_bytes_ - std::min(held_, max_bytes_)) give_back();
      held_ += size;
      return Buffer(new std::byte[size]);
    }
    Buffer buffer = std::move(free.back());
    free.pop_back();
    return buffer;
  }

  /// Otherwise, after a lasting change of datagram sizes, buffers of the old sizes would remain allocated.
  void give_back() {
    for (std::size_t size_class = 0; size_class < kSizeClasses; ++size_class) {
      held_ -= free_buffers_[size_class].size() * (kSmallestBuffer << size_class);
      free_buffers_[size_class].clear();
    }
  }

  std::size_t max_bytes_;
  std::size_t bytes_ = 0;
  std::size_t held_ = 0;  // bytes of buffers, used and free
  std::uint64_t launched_ = 0;
  std::vector<Place> places_;
  std::vector<std::uint32_t> free_places_;
  std::array<std::vector<Buffer>, kSizeClasses> free_buffers_;
  std::vector<Waiting> heap_;
};

}  // namespace tendon::injector
