// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <utility>

namespace tendon::softbody {

/// A value that is computed on first use. Thread-safe: get() is. Realtime-safe: no.
template <class T>
class Lazy {
 public:
  Lazy() = default;
  ~Lazy() = default;
  Lazy(const Lazy& other) { take(other.made() != nullptr ? std::make_unique<const T>(*other.made()) : nullptr); }
  Lazy(Lazy&& other) noexcept { take(other.give()); }
  Lazy& operator=(const Lazy& other) {
    if (this != &other) take(other.made() != nullptr ? std::make_unique<const T>(*other.made()) : nullptr);
    return *this;
  }
  Lazy& operator=(Lazy&& other) noexcept {
    take(other.give());
    return *this;
  }

  /// Returns the value. Calls `make` at most once, even with concurrent callers.
  template <class Make>
  const T& get(const Make& make) const {
    if (const T* const value = made()) return *value;
    const std::lock_guard lock(mutex_);
    if (made() == nullptr) {
      owner_ = std::make_unique<const T>(make());
      value_.store(owner_.get(), std::memory_order_release);
    }
    return *owner_;
  }

  const T* made() const noexcept { return value_.load(std::memory_order_acquire); }

 private:
  void take(std::unique_ptr<const T> value) {
    owner_ = std::move(value);
    value_.store(owner_.get(), std::memory_order_release);
  }
  std::unique_ptr<const T> give() {
    value_.store(nullptr, std::memory_order_release);
    return std::move(owner_);
  }

  mutable std::mutex mutex_;
  mutable std::unique_ptr<const T> owner_;
  mutable std::atomic<const T*> value_{nullptr};
};

}  // namespace tendon::softbody
