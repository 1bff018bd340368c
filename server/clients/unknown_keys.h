// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/time.h"
#include "protocol/link.h"

namespace tendon {

/// Logs the number of Hellos with an unknown key, which get no reply, and the newest address, at most once per minute.
class UnknownKeys {
 public:
  static constexpr Duration kPeriod = std::chrono::minutes(1);

  static std::string notice(const Address& from) { return std::string(kNotice) + to_string(from); }
  static bool is_notice(std::string_view text) noexcept { return text.starts_with(kNotice); }

  bool take(std::string_view notice) {
    if (!is_notice(notice)) return false;
    newest_ = notice.substr(kNotice.size());
    return true;
  }

  bool due(LocalTime now) const noexcept { return !newest_.empty() && now >= next_; }

  /// `total` is the number since the start of the server.
  std::string line(LocalTime now, std::uint64_t total) {
    const std::uint64_t count = total - std::exchange(told_, total);
    next_ = now + kPeriod;
    return std::to_string(count) + (count == 1 ? " Hello" : " Hellos") +
           " with a key that is not in the folder `keys` of [network], the newest from " + std::exchange(newest_, {}) +
           ": this client gets no reply";
  }

 private:
  static constexpr std::string_view kNotice = "a Hello with an unknown key from ";

  std::string newest_;
  std::uint64_t told_ = 0;
  LocalTime next_ = LocalTime::min();
};

}  // namespace tendon
