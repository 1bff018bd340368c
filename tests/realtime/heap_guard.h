// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// Counts heap calls of the calling thread: malloc, calloc, realloc, free, aligned_alloc, posix_memalign, memalign, and
/// what calls them (new, delete, std::string). Link heap_guard.cc, which interposes glibc's malloc in this executable,
/// but not in sanitizer builds.
class HeapGuard {
 public:
  HeapGuard();
  ~HeapGuard();
  HeapGuard(const HeapGuard&) = delete;
  HeapGuard& operator=(const HeapGuard&) = delete;

  std::uint64_t calls() const;
};

}  // namespace tendon
