// SPDX-License-Identifier: Apache-2.0
#include "server/machine/log.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <ctime>
#include <iostream>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "protocol/wire/text.h"
#include "server/machine/clock.h"

namespace tendon::log {
namespace {

struct Level {
  std::string_view name;
  std::string_view color;
};

std::string time_of_day(LocalTime now) {
  const Duration unix_time = now.time_since_epoch() + clock::unix_offset();
  const std::time_t second = std::chrono::floor<std::chrono::seconds>(unix_time).count();
  std::tm parts{};
  localtime_r(&second, &parts);
  std::array<char, 16> text{};
  std::strftime(text.data(), text.size(), "%H:%M:%S", &parts);
  const auto millisecond = std::chrono::floor<std::chrono::milliseconds>(unix_time).count() % 1000;
  return std::string(text.data()) + "." + std::to_string(1000 + millisecond).substr(1);
}

std::string line(const Level& level, LocalTime now, std::string_view text) {
  static const bool kInColor = ::isatty(STDERR_FILENO) == 1;
  std::string name(level.name);
  if (kInColor) name = "\033[" + std::string(level.color) + "m" + name + "\033[m";
  return time_of_day(now) + " " + name + " " + visible(text) + "\n";
}

std::optional<std::uint64_t> admit(std::string_view text, LocalTime now) {
  constexpr std::size_t kMaxKinds = 1000;
  static std::mutex mutex;
  static std::map<std::string, Rate> rates;
  std::string kind(text.substr(0, text.find('"')));
  std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
  const std::scoped_lock lock(mutex);
  if (rates.size() >= kMaxKinds && !rates.contains(kind)) kind.clear();
  return rates[kind].admit(now);
}

void write(const Level& level, std::string_view text) {
  const LocalTime now = clock::now();
  const auto refused = admit(text, now);
  if (!refused) return;
  std::string lines;
  if (*refused > 0) lines = line(level, now, std::to_string(*refused) + " similar lines were omitted");
  std::cerr << lines + line(level, now, text);
}

}  // namespace

void info(std::string_view text) { write({"info", "32"}, text); }
void warn(std::string_view text) { write({"warning", "33;1"}, text); }
void error(std::string_view text) { write({"error", "31;1"}, text); }

std::optional<std::uint64_t> Rate::admit(LocalTime now) {
  if (last_) available_ = std::min(kBurst, available_ + seconds(now - *last_) * kLinesPerSecond);
  last_ = now;
  if (available_ < 1) {
    ++refused_;
    return {};
  }
  available_ -= 1;
  return std::exchange(refused_, 0);
}

}  // namespace tendon::log
