// SPDX-License-Identifier: Apache-2.0
// Tests the threads of libhdPhantom.so in this process, with shared memory that belongs to the test.
#include <dlfcn.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>

#include "clients/bridge/chai3d/shared_hand.h"
#include "clients/cpp/machine.h"

namespace tendon::bridge::chai3d::hd_phantom_test {
namespace {

/// The maximum time that the library waits for a state.
constexpr auto kLongestPace = std::chrono::milliseconds(2);

/// The library searches for devices once per process, so there is only one instance.
class Library {
 public:
  static Library& get() {
    static Library once;
    return once;
  }

  void come() {
    ++tick_;
    for (std::size_t i = 0; i < hands_->devices; ++i) {
      hands_->device[i].hand.put(
          {.at_ns = std::chrono::nanoseconds(read_clock().time_since_epoch()).count(), .tick = tick_});
    }
    hands_->news.fetch_add(1);
  }
  void read(int device = 0) {
    double x = 0;
    double y = 0;
    double z = 0;
    EXPECT_NE(position_(device, &x, &y, &z), 0);
  }
  Duration set_force(int device = 0) {
    const double zero = 0;
    const LocalTime before = read_clock();
    EXPECT_NE(force_(device, &zero, &zero, &zero), -1);
    return read_clock() - before;
  }

 private:
  Library() {
    const int file = ::memfd_create("hands", MFD_CLOEXEC);
    void* memory = MAP_FAILED;
    if (file >= 0 && ::ftruncate(file, sizeof(SharedHands)) == 0) {
      memory = ::mmap(nullptr, sizeof(SharedHands), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    }
    if (memory == MAP_FAILED) throw std::runtime_error("no shared memory");
    hands_ = new (memory) SharedHands;
    hands_->devices = 2;
    hands_->ready = 1;
    ::setenv(kMemoryVariable, ("/proc/self/fd/" + std::to_string(file)).c_str(), 1);
    ::setenv(kWakeVariable, "nobody", 1);
    void* const library = ::dlopen(TENDON_HD_PHANTOM, RTLD_NOW);
    if (library == nullptr) throw std::runtime_error(::dlerror());
    position_ = reinterpret_cast<Position>(::dlsym(library, "hdPhantomGetPosition"));
    force_ = reinterpret_cast<Force>(::dlsym(library, "hdPhantomSetForce"));
    const auto open = reinterpret_cast<int (*)(int)>(::dlsym(library, "hdPhantomOpen"));
    for (int device = 0; device < 2; ++device) open(device);
  }

  using Position = int (*)(int, double*, double*, double*);
  using Force = int (*)(int, const double*, const double*, const double*);

  SharedHands* hands_ = nullptr;
  std::uint64_t tick_ = 0;
  Position position_ = nullptr;
  Force force_ = nullptr;
};

TEST(HdPhantom, AForceWaitsForAStateThatItsThreadHasNotRead) {
  Library& library = Library::get();
  library.come();
  library.read();
  EXPECT_GE(library.set_force(), kLongestPace);
}

TEST(HdPhantom, AThreadThatLooksOnTakesNoStateFromTheThreadThatPushes) {
  // Drawing and forces may be in different threads. The machine may delay one of the attempts, but not all.
  Library& library = Library::get();
  library.come();
  Duration shortest = Duration::max();
  for (int i = 0; i < 20; ++i) {
    library.read();
    library.come();
    std::thread([&] { library.read(); }).join();
    shortest = std::min(shortest, library.set_force());
  }
  EXPECT_LT(shortest, kLongestPace);
}

TEST(HdPhantom, AThreadThatReadsNothingPushesOnceAState) {
  Library& library = Library::get();
  library.come();
  std::thread([&] {
    library.set_force();
    EXPECT_GE(library.set_force(), kLongestPace) << "the same state paces no second force";
  }).join();
}

TEST(HdPhantom, AThreadThatPushesTwoDevicesInTurnWaitsOnceATurn) {
  // An example of CHAI3D accesses several devices in sequence.
  Library& library = Library::get();
  library.come();
  std::thread([&] {
    Duration shortest = Duration::max();
    for (int i = 0; i < 20; ++i) {
      library.read(0);
      EXPECT_GE(library.set_force(0), kLongestPace) << i;
      library.read(1);
      shortest = std::min(shortest, library.set_force(1));
    }
    EXPECT_LT(shortest, kLongestPace);
    EXPECT_GE(library.set_force(1), kLongestPace) << "the first device is pushed no more: the other one sets the pace";
    EXPECT_GE(library.set_force(1), kLongestPace);
  }).join();
}

}  // namespace
}  // namespace tendon::bridge::chai3d::hd_phantom_test
