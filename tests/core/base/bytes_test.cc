// SPDX-License-Identifier: Apache-2.0
#include "core/base/bytes.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>

namespace tendon::bytes_test {
namespace {

TEST(Bytes, TheLowestByteIsFirst) {
  constexpr auto bytes = little_endian(std::uint32_t{0x1122'3344});
  EXPECT_EQ(bytes, (std::array{std::byte{0x44}, std::byte{0x33}, std::byte{0x22}, std::byte{0x11}}));
  EXPECT_EQ(get_little_endian<std::uint32_t>(bytes.data()), 0x1122'3344U);
  EXPECT_EQ(get_little_endian<std::uint16_t>(bytes.data() + 1), 0x2233U);
}

TEST(Bytes, EveryBitOfEverySizeComesBack) {
  for (int bit = 0; bit < 64; ++bit) {
    const auto number = std::uint64_t{1} << bit | 1U;
    EXPECT_EQ(get_little_endian<std::uint64_t>(little_endian(number).data()), number);
  }
  for (int bit = 0; bit < 16; ++bit) {
    const auto number = static_cast<std::uint16_t>(1U << bit);
    EXPECT_EQ(get_little_endian<std::uint16_t>(little_endian(number).data()), number);
  }
}

TEST(Bytes, NeighboursAreLeftAlone) {
  std::array<std::byte, 4> bytes{};
  put_little_endian(std::uint16_t{0xFFFF}, bytes.data() + 1);
  EXPECT_EQ(bytes, (std::array{std::byte{0}, std::byte{0xFF}, std::byte{0xFF}, std::byte{0}}));
}

}  // namespace
}  // namespace tendon::bytes_test
