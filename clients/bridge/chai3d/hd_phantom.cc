// SPDX-License-Identifier: Apache-2.0
// libhdPhantom.so: the 14 C functions that CHAI3D's Phantom driver loads. It runs in the process of the CHAI3D
// program and must not interfere with it: no threads, no signals, no exceptions, no Protocol Buffers, and at most one
// line of output. It only accesses the memory shared with tendon-bridge.
//
// The semantics of the functions are those of CHAI3D's CPhantomDevices.cpp (3.2 and 3.3, BSD-3): the getters and
// Close return 0 on failure, the force functions −1, and the result of Open is ignored.
#include <fcntl.h>
#include <linux/futex.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <utility>

#include "clients/bridge/chai3d/shared_hand.h"

namespace tendon::bridge::chai3d {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kLongestCount = 400 * kMillisecond;  ///< CHAI3D counts its devices only once, at the start
constexpr std::int64_t kOldestState = 500 * kMillisecond;   ///< older states: the bridge or the server has stopped
constexpr std::int64_t kLongestPace = 2 * kMillisecond;
constexpr int kFailure = 0;
constexpr int kSuccess = 1;
constexpr int kForceFailure = -1;
constexpr int kForceSuccess = 0;

std::int64_t now_ns() noexcept {
  timespec time{};
  ::clock_gettime(CLOCK_MONOTONIC, &time);
  return time.tv_sec * 1'000'000'000 + time.tv_nsec;
}

/// A spin lock for writers that is held for about 30 stores. Acquiring it fails if the holding thread was killed.
class Turnstile {
 public:
  explicit Turnstile(std::atomic_flag& flag) noexcept : flag_(flag) {
    for (int i = 0; i < 10000 && !entered_; ++i) entered_ = !flag_.test_and_set(std::memory_order_acquire);
  }
  ~Turnstile() {
    if (entered_) flag_.clear(std::memory_order_release);
  }
  Turnstile(const Turnstile&) = delete;
  Turnstile& operator=(const Turnstile&) = delete;
  bool entered() const noexcept { return entered_; }

 private:
  std::atomic_flag& flag_;
  bool entered_ = false;
};

struct Handle {
  std::atomic_flag writing = ATOMIC_FLAG_INIT;
  Asked asked;  ///< newest request; protected by `writing`
};

/// Tick of the newest state of each device that this thread has read or waited for. Per thread, so that a graphics
/// thread does not consume states of the haptic thread.
thread_local std::array<std::uint64_t, SharedHands::kMaxDevices> tick_read{};

/// Selects the device for which a thread waits. This is the first of the devices that it updates. One iteration of
/// the program is then one haptic step, independent of the order in which it reads states and sets forces.
class Pacer {
 public:
  /// Returns whether setting a force on this device waits. If the thread sets forces on another device twice in
  /// between, for example after closing the first one, that device is selected instead.
  bool waits(int id) noexcept {
    const std::uint32_t bit = 1U << static_cast<unsigned>(id);
    if (id != device_ && device_ >= 0 && (others_ & bit) == 0) {
      others_ |= bit;
      return false;
    }
    device_ = id;
    others_ = 0;
    return true;
  }

 private:
  int device_ = -1;
  std::uint32_t others_ = 0;  ///< bit mask of the devices updated since device_
};
static_assert(SharedHands::kMaxDevices <= 32);
thread_local Pacer pacer;

class Attached {
 public:
  Attached() noexcept {
    // NOLINTBEGIN(concurrency-mt-unsafe): nobody here changes the environment
    const char* const memory = std::getenv(kMemoryVariable);
    const char* const wake = std::getenv(kWakeVariable);
    // NOLINTEND(concurrency-mt-unsafe)
    if (memory == nullptr || wake == nullptr || !map(memory)) {
      constexpr char kSaid[] = "libhdPhantom: no device; start this program with `tendon-bridge chai3d -- PROGRAM`\n";
      if (::write(STDERR_FILENO, kSaid, sizeof kSaid - 1) < 0) return;  // stderr is closed
      return;
    }
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    address_.sun_family = AF_UNIX;
    const std::size_t length = std::min(std::strlen(wake), sizeof address_.sun_path - 1);
    std::memcpy(&address_.sun_path[1], wake, length);
    address_size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  }

  SharedHands* hands() const noexcept { return hands_; }
  SharedDevice* device(int id) const noexcept {
    return hands_ != nullptr && id >= 0 && static_cast<std::uint32_t>(id) < hands_->devices
               ? &hands_->device[static_cast<std::size_t>(id)]
               : nullptr;
  }
  Handle& handle(int id) noexcept { return handles_[static_cast<std::size_t>(id)]; }

  void wake() const noexcept {
    ::sendto(socket_, "", 1, MSG_DONTWAIT | MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&address_), address_size_);
  }

  void sleep_until_news(std::uint32_t seen, std::int64_t end) noexcept {
    const std::int64_t left = end - now_ns();
    if (left <= 0) return;
    const timespec timeout{0, left};
    hands_->waiting.fetch_add(1);
    ::syscall(SYS_futex, &hands_->news, FUTEX_WAIT, seen, &timeout, nullptr, 0);
    hands_->waiting.fetch_sub(1);
  }

 private:
  bool map(const char* path) noexcept {
    const int file = ::open(path, O_RDWR | O_CLOEXEC);
    if (file < 0) return false;
    struct stat about {};
    void* memory = MAP_FAILED;
    if (::fstat(file, &about) == 0 && about.st_size == static_cast<off_t>(sizeof(SharedHands))) {
      memory = ::mmap(nullptr, sizeof(SharedHands), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    }
    ::close(file);
    if (memory == MAP_FAILED) return false;
    hands_ = static_cast<SharedHands*>(memory);
    if (hands_->version != SharedHands::kVersion || hands_->devices > SharedHands::kMaxDevices) hands_ = nullptr;
    return hands_ != nullptr;
  }

  SharedHands* hands_ = nullptr;
  int socket_ = -1;
  sockaddr_un address_{};
  socklen_t address_size_ = 0;
  std::array<Handle, SharedHands::kMaxDevices> handles_;
};

Attached& attached() noexcept {
  static Attached once;
  return once;
}

bool read(int id, HandNow& hand) noexcept {
  const SharedDevice* const device = attached().device(id);
  if (device == nullptr || !device->hand.get(hand)) return false;
  tick_read[static_cast<std::size_t>(id)] = hand.tick;
  return now_ns() - hand.at_ns <= kOldestState;
}

/// Blocks until a new state for this thread, at most kLongestPace: the haptic loops of CHAI3D do not sleep themselves.
void pace(int id) noexcept {
  Attached& memory = attached();
  if (memory.hands()->paced == 0 || !pacer.waits(id)) return;
  std::uint64_t& known = tick_read[static_cast<std::size_t>(id)];
  const std::int64_t end = now_ns() + kLongestPace;
  for (;;) {
    const std::uint32_t seen = memory.hands()->news.load();
    HandNow hand;
    if (memory.device(id)->hand.get(hand) && hand.tick != std::exchange(known, hand.tick)) return;
    if (now_ns() >= end) return;
    memory.sleep_until_news(seen, end);
  }
}

/// Applies `change` to the request and wakes tendon-bridge. Returns false if another process owns the device.
template <typename Change>
bool ask(int id, Change change) noexcept {
  SharedDevice* const device = attached().device(id);
  if (device == nullptr || device->owner.load() != ::getpid()) return false;
  Handle& handle = attached().handle(id);
  const Turnstile turn(handle.writing);
  if (!turn.entered()) return false;
  change(handle.asked);
  handle.asked.at_ns = now_ns();
  ++handle.asked.count;
  device->asked.put(handle.asked);
  attached().wake();
  return true;
}

void set(std::array<double, 3>& vector, const double* x, const double* y, const double* z) noexcept {
  vector = {*x, *y, *z};
}

}  // namespace
}  // namespace tendon::bridge::chai3d

using namespace tendon::bridge::chai3d;  // NOLINT(google-build-using-namespace): 14 functions for C

#pragma GCC visibility push(default)
// NOLINTBEGIN(readability-identifier-naming): the names are CHAI3D's
extern "C" {

int hdPhantomGetNumDevices() {
  SharedHands* const hands = attached().hands();
  if (hands == nullptr) return 0;
  // Later calls do not wait again, because CHAI3D counts the devices again for each of them.
  static const std::int64_t end = now_ns() + kLongestCount;
  for (;;) {
    const std::uint32_t seen = hands->news.load();
    if (hands->ready.load(std::memory_order_acquire) != 0) return static_cast<int>(hands->devices);
    if (now_ns() >= end) return 0;
    attached().sleep_until_news(seen, end);
  }
}

int hdPhantomOpen(int id) {
  SharedDevice* const device = attached().device(id);
  if (device == nullptr) return kForceFailure;
  std::int32_t owner = device->owner.load();
  const auto self = static_cast<std::int32_t>(::getpid());
  // The owner may have been killed without closing the device.
  const bool is_free = owner == 0 || owner == self || (::kill(owner, 0) != 0 && errno == ESRCH);
  return is_free && device->owner.compare_exchange_strong(owner, self) ? id : kForceFailure;
}

int hdPhantomClose(int id) {
  const bool ours = ask(id, [](Asked& asked) {
    asked.open = 0;
    asked.force = asked.torque = {};
  });
  if (!ours) return kFailure;
  attached().device(id)->owner.store(0);
  return kSuccess;
}

int hdPhantomGetPosition(int id, double* x, double* y, double* z) {
  HandNow hand;
  const bool fresh = read(id, hand);
  *x = hand.position[0], *y = hand.position[1], *z = hand.position[2];
  return fresh ? kSuccess : kFailure;
}

int hdPhantomGetLinearVelocity(int id, double* x, double* y, double* z) {
  HandNow hand;
  const bool fresh = read(id, hand);
  *x = hand.velocity[0], *y = hand.velocity[1], *z = hand.velocity[2];
  return fresh ? kSuccess : kFailure;
}

int hdPhantomGetRotation(int id, double* r00, double* r01, double* r02, double* r10, double* r11, double* r12,
                         double* r20, double* r21, double* r22) {
  HandNow hand;
  hand.rotation = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const bool fresh = read(id, hand);
  const std::array<double*, 9> out = {r00, r01, r02, r10, r11, r12, r20, r21, r22};
  for (std::size_t i = 0; i < out.size(); ++i) *out[i] = hand.rotation[i];
  return fresh ? kSuccess : kFailure;
}

int hdPhantomGetButtons(int id) {
  HandNow hand;
  return read(id, hand) ? static_cast<int>(hand.buttons) : 0;
}

int hdPhantomSetForce(int id, const double* x, const double* y, const double* z) {
  const bool taken = ask(id, [&](Asked& asked) {
    asked.open = 1;
    set(asked.force, x, y, z);
  });
  if (taken) pace(id);
  return taken ? kForceSuccess : kForceFailure;
}

int hdPhantomSetTorque(int id, const double* x, const double* y, const double* z) {
  const bool taken = ask(id, [&](Asked& asked) {
    asked.open = 1;
    set(asked.torque, x, y, z);
  });
  return taken ? kForceSuccess : kForceFailure;
}

int hdPhantomSetForceAndTorque(int id, const double* fx, const double* fy, const double* fz, const double* tx,
                               const double* ty, const double* tz) {
  const bool taken = ask(id, [&](Asked& asked) {
    asked.open = 1;
    set(asked.force, fx, fy, fz);
    set(asked.torque, tx, ty, tz);
  });
  if (taken) pace(id);
  return taken ? kForceSuccess : kForceFailure;
}

int hdPhantomGetWorkspaceRadius(int id, double* radius) {
  const SharedDevice* const device = attached().device(id);
  if (device == nullptr || attached().hands()->ready.load(std::memory_order_acquire) == 0) return kFailure;
  *radius = device->workspace_radius;
  return kSuccess;
}

int hdPhantomGetType(int id, char* type) {
  const SharedDevice* const device = attached().device(id);
  if (device == nullptr || attached().hands()->ready.load(std::memory_order_acquire) == 0) {
    type[0] = '\0';
    return kFailure;
  }
  std::memcpy(type, device->model.data(), device->model.size());
  return kSuccess;
}

// The haptic loop runs in the server. CHAI3D calls hdPhantomStopServo in every Close, even if other devices are open.
void hdPhantomStartServo() {}
void hdPhantomStopServo() {}

}  // extern "C"
// NOLINTEND(readability-identifier-naming)
#pragma GCC visibility pop
