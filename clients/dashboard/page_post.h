// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

namespace tendon::dash {

/// Messages for one page. Only the newest text of each kind and kMaxBatches batches of states are kept.
/// Thread-safe: no. Realtime-safe: no.
class PagePost {
 public:
  enum class Kind : std::uint8_t {
    kServer,   ///< only the newest text of each kind is kept
    kReports,  //
    kPorts,    //
  };
  static constexpr std::size_t kMaxBatches = 8;  ///< 1/8 s, which a page can catch up without visible delay

  void put(Kind kind, std::string text) { newest_[static_cast<std::size_t>(kind)] = std::move(text); }

  /// Adds a batch of `states` states. If the queue is full, the oldest batch is dropped and its states are counted.
  void put_states(std::string text, std::size_t states) {
    batches_.push_back({std::move(text), states});
    if (batches_.size() <= kMaxBatches) return;
    skipped_ += batches_.front().states;
    batches_.pop_front();
  }

  /// Replaces the waiting state of a device that the page does not watch.
  void put_beside(std::uint32_t device, std::string text) { beside_[device] = std::move(text); }

  std::uint64_t take_skipped() noexcept { return std::exchange(skipped_, 0); }  ///< states dropped since the last call

  std::optional<std::string> next() {
    for (auto& text : newest_) {
      if (text) return std::exchange(text, std::nullopt);
    }
    if (!beside_.empty()) return std::move(beside_.extract(beside_.begin()).mapped());
    if (batches_.empty()) return std::nullopt;
    std::string text = std::move(batches_.front().text);
    batches_.pop_front();
    return text;
  }

  void forget_states() {  // the page has selected another device
    batches_.clear();
    beside_.clear();
    newest_[static_cast<std::size_t>(Kind::kReports)].reset();
    newest_[static_cast<std::size_t>(Kind::kPorts)].reset();
    skipped_ = 0;
  }

 private:
  struct Batch {
    std::string text;
    std::size_t states;
  };
  std::array<std::optional<std::string>, 3> newest_;
  std::map<std::uint32_t, std::string> beside_;
  std::deque<Batch> batches_;
  std::uint64_t skipped_ = 0;
};

}  // namespace tendon::dash
