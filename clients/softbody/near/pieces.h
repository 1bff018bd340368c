// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <coroutine>
#include <utility>

namespace tendon::softbody {

/// Work that is done in pieces: a coroutine that says `co_await kPieceDone` behind each. What it refers to must live as
/// long as this. Where a piece throws, next() throws, and no piece is left.
///
/// Thread-safe: no. Realtime-safe: no.
class [[nodiscard]] Pieces {
 public:
  struct promise_type {  // NOLINT(readability-identifier-naming): the language has this name
    Pieces get_return_object() { return Pieces(std::coroutine_handle<promise_type>::from_promise(*this)); }
    std::suspend_always initial_suspend() noexcept { return {}; }
    std::suspend_always final_suspend() noexcept { return {}; }
    void return_void() noexcept {}
    void unhandled_exception() { throw; }
  };

  Pieces(Pieces&& other) noexcept : work_(std::exchange(other.work_, nullptr)) {}
  Pieces& operator=(Pieces&& other) noexcept {
    std::swap(work_, other.work_);
    return *this;
  }
  ~Pieces() {
    if (work_) work_.destroy();
  }

  /// Does the next piece. False when none is left.
  bool next() {
    if (!work_.done()) work_.resume();
    return !work_.done();
  }

 private:
  explicit Pieces(std::coroutine_handle<promise_type> work) : work_(work) {}

  std::coroutine_handle<promise_type> work_;
};

inline constexpr std::suspend_always kPieceDone{};

}  // namespace tendon::softbody
