// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that shifts a program's wall clock by the ns (text) in the file TENDON_CLOCK_STEP names.
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <ctime>

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const auto result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (result != 0 || clock != CLOCK_REALTIME) return result;
  const char* path = std::getenv("TENDON_CLOCK_STEP");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  const int file = path == nullptr ? -1 : open(path, O_RDONLY | O_CLOEXEC);
  if (file < 0) return result;
  std::array<char, 32> text{};
  if (read(file, text.data(), text.size() - 1) > 0) {
    constexpr std::int64_t kSecond = 1'000'000'000;
    const std::int64_t wrong = time->tv_sec * kSecond + time->tv_nsec + std::atoll(text.data());
    time->tv_sec = wrong / kSecond;
    time->tv_nsec = wrong % kSecond;
  }
  close(file);
  return result;
}
