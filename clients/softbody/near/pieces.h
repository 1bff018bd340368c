// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <coroutine>
#include <utility>

namespace tendon::softbody {

/// A coroutine that is divided into pieces by `co_await kPieceDone`. Its arguments must outlive it. If a piece throws,
/// next() throws, and there are no more pieces. Thread-safe: no. Realtime-safe: no.
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

  /// Runs the next piece. Returns false when none remains.
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
