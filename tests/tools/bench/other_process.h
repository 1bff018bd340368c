// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <ctime>
#include <exception>
#include <new>
#include <stdexcept>
#include <string>

#include "core/base/time.h"

namespace tendon::bench {

/// Throws std::system_error with errno.
[[noreturn]] void fail(const std::string& what);

Duration read(clockid_t clock);

void raise_file_limit();

/// This must be called in a child right after fork(). The child is then killed by the kernel when its parent dies.
void end_with_parent();

/// Sets the real-time priority of the calling thread and removes its timer slack. Does nothing if it is 0.
class AtPriority {
 public:
  /// Throws std::system_error if the kernel refuses.
  explicit AtPriority(int priority);
  ~AtPriority();
  AtPriority(const AtPriority&) = delete;
  AtPriority& operator=(const AtPriority&) = delete;

 private:
  bool raised_ = false;
};

template <class T>
class SharedMemory {
 public:
  SharedMemory() {
    void* const memory = ::mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) fail("mmap");
    value_ = new (memory) T;
  }
  ~SharedMemory() { ::munmap(value_, sizeof(T)); }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  T* operator->() const { return value_; }
  T& operator*() const { return *value_; }

 private:
  T* value_;
};

class OtherProcess {
 public:
  template <class Work>
  explicit OtherProcess(Work work) : pid_(::fork()) {
    if (pid_ < 0) fail("fork");
    if (pid_ > 0) return;
    end_with_parent();
    try {
      work();
      ::_exit(0);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "tendon-lab bench: helper process: %s\n", error.what());
      ::_exit(1);
    }
  }
  ~OtherProcess() { ::waitpid(pid_, nullptr, 0); }
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;

  /// Throws if the child has exited.
  void check() const {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) throw std::runtime_error("a helper process has ended");
  }
  void signal(int number) const { ::kill(pid_, number); }
  pid_t pid() const { return pid_; }
  Duration processor_time() const {
    clockid_t clock{};
    ::clock_getcpuclockid(pid_, &clock);
    return read(clock);
  }

 private:
  pid_t pid_;
};

}  // namespace tendon::bench
