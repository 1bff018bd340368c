// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/metadata.h"

#include <zlib.h>

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>

namespace tendon::lab {
namespace {

std::string big_endian(std::uint32_t value) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 0xFF);
  return bytes;
}

/// An uncompressed iTXt chunk without a language.
std::string text_chunk(std::string_view key, std::string_view text) {
  std::string chunk = "iTXt" + std::string(key) + std::string(5, '\0') + std::string(text);
  const auto size = static_cast<std::uint32_t>(chunk.size() - 4);
  const uLong sum = crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), static_cast<uInt>(chunk.size()));
  return big_endian(size) + chunk + big_endian(static_cast<std::uint32_t>(sum));
}

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '&':
        result += "&amp;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

}  // namespace

void add_metadata(const std::filesystem::path& picture, std::string_view key, std::string_view text) {
  std::ifstream in(picture, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (picture.extension() == ".png") {
    constexpr std::size_t kAfterHeader = 8 + 25;  // signature and IHDR
    if (bytes.size() < kAfterHeader || bytes.compare(12, 4, "IHDR") != 0) {
      throw std::runtime_error(picture.string() + ": expected a PNG file");
    }
    bytes.insert(kAfterHeader, text_chunk(key, text));
  } else {
    constexpr std::string_view kEnd = "</desc>";
    const std::size_t end = bytes.find(kEnd);
    if (end == std::string::npos) throw std::runtime_error(picture.string() + ": expected an SVG file with <desc>");
    bytes.insert(end, escaped(text) + "\n");
  }
  std::filesystem::path replacement = picture;
  replacement += ".new";
  std::ofstream out(replacement, std::ios::binary);
  out << bytes;
  out.close();
  if (!out) {
    std::error_code ignored;
    std::filesystem::remove(replacement, ignored);
    throw std::runtime_error("cannot write " + picture.string() + ": is the disk full?");
  }
  std::filesystem::rename(replacement, picture);
}

}  // namespace tendon::lab
