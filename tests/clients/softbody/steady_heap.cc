// SPDX-License-Identifier: Apache-2.0
// malloc and its relatives, single-threaded, with a free list for each power of two.
#include "tests/clients/softbody/steady_heap.h"

#include <array>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace {

constexpr std::size_t kAlignment = 64;
constexpr std::size_t kArena = std::size_t{1} << 29;

struct alignas(kAlignment) Block {
  std::size_t asked;
  std::size_t power;
  Block* next;
};

alignas(kAlignment) std::array<unsigned char, kArena> arena;
std::size_t used = 0;
std::size_t live = 0;
std::array<Block*, 64> unused{};

void* take(std::size_t size) noexcept {
  const auto power = static_cast<std::size_t>(std::bit_width((size | 63) + sizeof(Block) - 1));
  Block* block = unused[power];
  if (block != nullptr) {
    unused[power] = block->next;
  } else {
    const std::size_t whole = std::size_t{1} << power;
    if (power > 40 || whole > kArena - used) return nullptr;
    block = reinterpret_cast<Block*>(&arena[used]);
    used += whole;
    block->power = power;
  }
  block->asked = size;
  live += size;
  return block + 1;
}

void give_back(void* pointer) noexcept {
  if (pointer == nullptr) return;
  Block* block = static_cast<Block*>(pointer) - 1;
  live -= block->asked;
  block->next = unused[block->power];
  unused[block->power] = block;
}

}  // namespace

std::size_t tendon::softbody::testing::bytes_on_heap() noexcept { return live; }

extern "C" {

void* malloc(std::size_t size) { return take(size); }
void free(void* pointer) { give_back(pointer); }

void* calloc(std::size_t count, std::size_t size) {
  if (size != 0 && count > kArena / size) return nullptr;
  void* pointer = take(count * size);
  if (pointer != nullptr) std::memset(pointer, 0, count * size);
  return pointer;
}

void* realloc(void* old, std::size_t size) {
  if (old == nullptr) return take(size);
  void* pointer = take(size);
  if (pointer == nullptr) return nullptr;
  const std::size_t before = (static_cast<Block*>(old) - 1)->asked;
  std::memcpy(pointer, old, before < size ? before : size);
  give_back(old);
  return pointer;
}

void* aligned_alloc(std::size_t alignment, std::size_t size) { return alignment > kAlignment ? nullptr : take(size); }
void* memalign(std::size_t alignment, std::size_t size) { return aligned_alloc(alignment, size); }
int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) {
  *pointer = aligned_alloc(alignment, size);
  return *pointer == nullptr ? ENOMEM : 0;
}

}  // extern "C"
