// SPDX-License-Identifier: Apache-2.0
//
// Implements sd_notify(3) and sd_watchdog_enabled(3) without libsystemd, which would load seven libraries.
#include "server/machine/service.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

namespace tendon::service {
namespace {

std::string_view variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nobody sets it
  return value == nullptr ? std::string_view() : value;
}

std::optional<std::int64_t> number(const char* name) {
  const std::string_view text = variable(name);
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size() || value <= 0) return {};
  return value;
}

void tell(std::string_view state) {
  const std::string_view manager = variable("NOTIFY_SOCKET");
  sockaddr_un to{};
  to.sun_family = AF_UNIX;
  if (manager.empty() || manager.size() > sizeof to.sun_path) return;
  std::copy(manager.begin(), manager.end(), to.sun_path);
  if (to.sun_path[0] == '@') to.sun_path[0] = '\0';  // abstract socket address, see unix(7)
  const int from = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (from < 0) return;
  ::sendto(from, state.data(), state.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to),
           static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + manager.size()));
  ::close(from);
}

}  // namespace

void ready() { tell("READY=1"); }

void stopping() { tell("STOPPING=1"); }

std::optional<Duration> watch_period() {
  const auto microseconds = number("WATCHDOG_USEC");
  if (!microseconds) return {};
  // This variable may have been inherited, and then contains the id of another process.
  if (!variable("WATCHDOG_PID").empty() && number("WATCHDOG_PID") != ::getpid()) return {};
  return std::chrono::microseconds(*microseconds / 2);
}

void alive() { tell("WATCHDOG=1"); }

}  // namespace tendon::service
