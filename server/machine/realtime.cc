// SPDX-License-Identifier: Apache-2.0
#include "server/machine/realtime.h"

#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <ranges>
#include <string_view>
#include <system_error>
#include <thread>

namespace tendon {

namespace {

void touch_stack() {
  constexpr std::size_t kBytes = 128 * 1024;
  constexpr std::size_t kPage = 4096;
  std::array<volatile std::byte, kBytes> stack;
  for (std::size_t i = 0; i < kBytes; i += kPage) stack[i] = std::byte{0};
}

struct Mapping {
  std::uintptr_t from = 0;
  std::uintptr_t to = 0;
  bool readable = false;
  std::string of;
};

std::vector<Mapping> mappings() {
  std::vector<Mapping> found;
  std::ifstream maps("/proc/self/maps");
  for (std::string line; std::getline(maps, line);) {
    Mapping mapping;
    // For example "55d0c0a7e000-55d0c0aa2000 r--p 00000000 fe:01 1835106   /usr/bin/tendond". Each haptic thread reads
    // this, and streams would need a tenth of the instructions until the server listens.
    const char* const end = line.data() + line.size();
    const char* at = std::from_chars(line.data(), end, mapping.from, 16).ptr;
    if (at != end) at = std::from_chars(at + 1, end, mapping.to, 16).ptr;
    mapping.readable = std::string_view(at, end).starts_with(" r");
    if (const std::size_t file = line.find_first_of("/["); file != std::string::npos) mapping.of = line.substr(file);
    found.push_back(std::move(mapping));
  }
  return found;
}

/// Excludes the libraries that only the network and log threads use.
bool is_of_a_step(const Mapping& mapping, const std::string& program) {
  if (mapping.of == program || mapping.of == "[heap]") return true;
  constexpr std::array<std::string_view, 2> kLibraries = {"libc.so", "libm.so"};
  const std::string_view file = std::string_view(mapping.of).substr(mapping.of.rfind('/') + 1);
  return std::ranges::any_of(kLibraries, [file](std::string_view library) { return file.starts_with(library); });
}

/// Locks pages when they are first used, and loads those that a haptic step may use. Returns 0 or errno.
int lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) != 0) return errno;
  const std::vector<Mapping> all = mappings();
  if (all.empty()) return mlockall(MCL_CURRENT | MCL_FUTURE) == 0 ? 0 : errno;
  const std::string& program = all.front().of;
  // The zero-initialized variables of a program are in the mapping after it.
  bool before = false;
  std::uintptr_t below = 0;
  for (const Mapping& mapping : all) {
    const bool goes_on = before && mapping.of.empty() && mapping.from == below;
    before = mapping.readable && (goes_on || is_of_a_step(mapping, program));
    below = mapping.to;
    if (before && mlock(reinterpret_cast<const void*>(mapping.from), mapping.to - mapping.from) != 0) return errno;
  }
  return 0;
}

}  // namespace

void use_small_stacks() {
  // A haptic thread touches 136 kB. Network and log threads used 16 kB in a measurement.
  constexpr std::size_t kBytes = 256 * 1024;
  pthread_attr_t usual;
  if (pthread_getattr_default_np(&usual) != 0) return;
  pthread_attr_t small;
  if (pthread_attr_init(&small) == 0) {
    if (pthread_attr_setstacksize(&small, kBytes) == 0 && pthread_setattr_default_np(&small) == 0) {
      try {
        std::thread([] {}).join();
      } catch (const std::system_error&) {  // thread-local data is also on the stack
        pthread_setattr_default_np(&usual);
      }
    }
    pthread_attr_destroy(&small);
  }
  pthread_attr_destroy(&usual);
}

void name_thread(const std::string& name) { prctl(PR_SET_NAME, name.c_str(), 0UL, 0UL, 0UL); }

int processors_allowed() {
  cpu_set_t allowed;
  return sched_getaffinity(0, sizeof allowed, &allowed) == 0 ? CPU_COUNT(&allowed) : 1;
}

void enter_punctual() { prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL); }

std::vector<std::string> enter_realtime(int priority) {
  std::vector<std::string> refused;
  enter_punctual();
  sched_param param{};
  param.sched_priority = priority;
  if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param); error != 0) {
    refused.push_back("the haptic thread runs without real-time priority (SCHED_FIFO " + std::to_string(priority) +
                      ": " + std::system_category().message(error) +
                      "); steps can be late under load. Allow it with LimitRTPRIO= in the systemd unit, or rtprio in "
                      "/etc/security/limits.d");
  }
  if (const int error = lock_memory(); error != 0) {
    refused.push_back("memory is not locked (mlockall: " + std::system_category().message(error) +
                      "); a page fault can delay a step. Allow it with LimitMEMLOCK=infinity in the systemd unit, or "
                      "memlock in /etc/security/limits.d");
  }
  touch_stack();
  return refused;
}

std::optional<std::string> stay_on(std::uint32_t cpu) {
  cpu_set_t only;
  CPU_ZERO(&only);
  int error = EINVAL;
  if (cpu < CPU_SETSIZE) {
    CPU_SET(cpu, &only);
    error = pthread_setaffinity_np(pthread_self(), sizeof only, &only);
  }
  if (error == 0) return std::nullopt;
  return "the haptic thread cannot run on processor " + std::to_string(cpu) +
         " (sched_setaffinity: " + std::system_category().message(error) +
         "); use a number from 0 to below `nproc --all` that is allowed by AllowedCPUs= and CPUAffinity= of the "
         "systemd unit";
}

WakefulProcessors::WakefulProcessors(const std::filesystem::path& file)
    : file_(open(file.c_str(), O_WRONLY | O_CLOEXEC)) {
  if (file_ < 0 && errno == ENOENT) return;
  const std::int32_t none = 0;  // µs
  held_ = file_ >= 0 && write(file_, &none, sizeof none) == static_cast<ssize_t>(sizeof none);
  if (held_) return;
  refused_ = "deep sleep states are not disabled (" + file.string() + ": " + std::system_category().message(errno) +
             "); a wake-up can take 0.1 ms and more. Allow it with a udev rule: KERNEL==\"cpu_dma_latency\", "
             "GROUP=\"plugdev\", MODE=\"0660\"";
}

WakefulProcessors::~WakefulProcessors() {
  if (file_ >= 0) close(file_);
}

}  // namespace tendon
