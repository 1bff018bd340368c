// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace tendon {

/// Counts the heap calls of the calling thread during its lifetime: malloc, calloc, realloc, free, aligned_alloc,
/// posix_memalign, memalign, and everything that calls them (new, delete, std::string). Used to show that the haptic
/// thread makes none.
///
/// Interposes glibc's malloc in this executable. Link heap_guard.cc to use it, but not in sanitizer builds.
class HeapGuard {
 public:
  HeapGuard();
  ~HeapGuard();
  HeapGuard(const HeapGuard&) = delete;
  HeapGuard& operator=(const HeapGuard&) = delete;

  std::uint64_t calls() const;
};

}  // namespace tendon
