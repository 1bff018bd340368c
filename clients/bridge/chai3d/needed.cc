// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/chai3d/needed.h"

#include <elf.h>

#include <cstdint>
#include <cstring>
#include <optional>

namespace tendon::bridge::chai3d {
namespace {

template <typename T>
std::optional<T> at(std::span<const std::byte> file, std::uint64_t offset) {
  if (offset > file.size() || file.size() - offset < sizeof(T)) return {};
  T value;
  std::memcpy(&value, file.data() + offset, sizeof(T));
  return value;
}

/// Converts an address of the loaded program to an offset in the file.
std::optional<std::uint64_t> offset_of(const std::vector<Elf64_Phdr>& segments, std::uint64_t address) {
  for (const Elf64_Phdr& segment : segments) {
    if (segment.p_type == PT_LOAD && address >= segment.p_vaddr && address - segment.p_vaddr < segment.p_filesz) {
      return address - segment.p_vaddr + segment.p_offset;
    }
  }
  return {};
}

std::string text_at(std::span<const std::byte> file, std::uint64_t offset) {
  std::string text;
  for (; offset < file.size() && file[offset] != std::byte{0}; ++offset) {
    text += static_cast<char>(std::to_integer<unsigned char>(file[offset]));
  }
  return text;
}

}  // namespace

std::vector<std::string> needed_libraries(std::span<const std::byte> file) {
  const auto header = at<Elf64_Ehdr>(file, 0);
  if (!header || std::memcmp(header->e_ident, ELFMAG, SELFMAG) != 0 || header->e_ident[EI_CLASS] != ELFCLASS64) {
    return {};
  }
  std::vector<Elf64_Phdr> segments;
  for (std::uint64_t i = 0; i < header->e_phnum; ++i) {
    const auto segment = at<Elf64_Phdr>(file, header->e_phoff + i * sizeof(Elf64_Phdr));
    if (!segment) return {};
    segments.push_back(*segment);
  }
  std::vector<std::uint64_t> names;  // offsets in the string table
  std::optional<std::uint64_t> strings;
  for (const Elf64_Phdr& segment : segments) {
    if (segment.p_type != PT_DYNAMIC) continue;
    for (std::uint64_t i = 0; i < segment.p_filesz / sizeof(Elf64_Dyn); ++i) {
      const auto entry = at<Elf64_Dyn>(file, segment.p_offset + i * sizeof(Elf64_Dyn));
      if (!entry || entry->d_tag == DT_NULL) break;
      if (entry->d_tag == DT_NEEDED) names.push_back(entry->d_un.d_val);
      if (entry->d_tag == DT_STRTAB) strings = offset_of(segments, entry->d_un.d_ptr);
    }
  }
  std::vector<std::string> libraries;
  if (!strings) return libraries;
  for (const std::uint64_t name : names) libraries.push_back(text_at(file, *strings + name));
  return libraries;
}

}  // namespace tendon::bridge::chai3d
