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

/// The messages that wait for one page while it is busy; the newest wins. A page that does not read costs at most one
/// text of each kind and a few batches of states, however long it sleeps.
///
/// Thread-safe: no. Realtime-safe: no.
class PagePost {
 public:
  enum class Kind : std::uint8_t {
    kServer,   ///< only the newest text of each of these kinds is kept
    kReports,  //
    kPorts,    //
  };
  /// The most batches that wait, an eighth of a second: a page can catch up with that, and the hand on the screen does
  /// not look late.
  static constexpr std::size_t kMaxBatches = 8;

  void put(Kind kind, std::string text) { newest_[static_cast<std::size_t>(kind)] = std::move(text); }

  /// Adds a batch of `states` states. When there is no room the oldest batch is dropped, and its states are counted.
  void put_states(std::string text, std::size_t states) {
    batches_.push_back({std::move(text), states});
    if (batches_.size() <= kMaxBatches) return;
    skipped_ += batches_.front().states;
    batches_.pop_front();
  }

  /// The newest state of a device beside the one that the page watches; only the newest is kept.
  void put_beside(std::uint32_t device, std::string text) { beside_[device] = std::move(text); }

  /// States dropped since the last call.
  std::uint64_t take_skipped() noexcept { return std::exchange(skipped_, 0); }

  /// The next text to send; empty when nothing waits.
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

  /// The page looks at another device: the waiting states of the previous one are of no use.
  void forget_states() {
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
