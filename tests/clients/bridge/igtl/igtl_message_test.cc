// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/igtl/igtl_message.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <string>
#include <string_view>

#include "tests/clients/bridge/igtl/program.h"

namespace tendon::bridge::igtl::igtl_message_test {
namespace {

Bytes bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

std::string hex(Bytes bytes) {
  std::string text;
  for (const std::byte one : bytes) {
    text += "0123456789abcdef"[std::to_integer<std::size_t>(one) >> 4U];
    text += "0123456789abcdef"[std::to_integer<std::size_t>(one) & 15U];
  }
  return text;
}

TEST(IgtlMessage, TheCrcIsThatOfEcma182) {
  EXPECT_EQ(crc64(bytes_of("123456789")), 0x6C40DF5F0B497347U) << "the check value of its catalogues";
  EXPECT_EQ(crc64({}), 0U);
}

TEST(IgtlMessage, ATransformHasAHeaderThenRotationByColumnsThenMillimetres) {
  Mat3 rotation;
  rotation << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  Buffer out;
  append_transform(out, {"right", std::chrono::seconds(1) + std::chrono::milliseconds(500)}, rotation,
                   Vec3(1, -2, 0.5));
  const std::string body =
      "00000000"
      "3f800000"
      "00000000"
      "bf800000"
      "00000000"
      "00000000"
      "00000000"
      "00000000"
      "3f800000"
      "3f800000"
      "c0000000"
      "3f000000";
  EXPECT_EQ(hex(out).substr(0, 100),
            "0001"
            "5452414e53464f524d000000"
            "7269676874" +
                std::string(30, '0') +
                "0000000180000000"
                "0000000000000030");
  EXPECT_EQ(hex(out).substr(116), body);
  EXPECT_EQ(hex(Bytes(out).subspan(kCrcAt, 8)), hex(Bytes(sealed(out)).subspan(kCrcAt, 8)));
}

TEST(IgtlMessage, ASensorIsInNewtonAndAStatusEndsWithAZero) {
  EXPECT_EQ(hex(Bytes(sensor("a", Vec3(1, -2, 0))).subspan(kHeaderSize)),
            "0300"
            "02c4000000000000"
            "3ff0000000000000"
            "c000000000000000"
            "0000000000000000");
  Buffer out;
  append_status(out, {"a", {}}, Status::kAccessDenied, "no");
  EXPECT_EQ(hex(Bytes(out).subspan(kHeaderSize)), "0005" + std::string(16 + 40, '0') + "6e6f00");
  out.clear();
  append_string(out, {"a", {}}, "yes");
  EXPECT_EQ(hex(Bytes(out).subspan(kHeaderSize)),
            "0003"
            "0003"
            "796573");
}

TEST(IgtlMessage, WhatIsSentIsReadAgain) {
  const Buffer target = transform("rightTarget", Vec3(1.5, -2.25, 1e4));
  const auto header = read_header(target);
  ASSERT_TRUE(header);
  EXPECT_EQ(header->type, kTransform);
  EXPECT_EQ(header->name, "rightTarget");
  EXPECT_EQ(header->body_size, 48U);
  EXPECT_EQ(read_position(Bytes(target).subspan(kHeaderSize)), Vec3(1.5, -2.25, 1e4));
  EXPECT_EQ(read_force(Bytes(sensor("a", Vec3(0.1, -2, 30))).subspan(kHeaderSize)), Vec3(0.1, -2, 30));
}

TEST(IgtlMessage, EachPrefixOfNewtonIsReadAndOtherUnitsAreRefused) {
  const auto force_in = [](std::uint64_t unit) {
    Buffer message = sensor("a", Vec3(2, 0, 0));
    put(message, kHeaderSize + 2, unit);
    return read_force(Bytes(message).subspan(kHeaderSize));
  };
  constexpr std::uint64_t kN = std::uint64_t{0x0b} << 54U | std::uint64_t{1} << 50U;
  EXPECT_EQ(force_in(0), Vec3(2, 0, 0)) << "not specified";
  EXPECT_EQ(force_in(std::uint64_t{0x0b} << 54U), Vec3(2, 0, 0)) << "without an exponent";
  EXPECT_EQ(force_in(std::uint64_t{0x0b} << 60U | kN), Vec3(2e-3, 0, 0)) << "mN";
  EXPECT_EQ(force_in(std::uint64_t{0x03} << 60U | kN), Vec3(2e3, 0, 0)) << "kN";
  EXPECT_FALSE(force_in(std::uint64_t{0x01} << 54U | std::uint64_t{1} << 50U)) << "m";
  EXPECT_FALSE(force_in(kN | std::uint64_t{0x01} << 44U)) << "N m";
  EXPECT_FALSE(force_in(std::uint64_t{0x07} << 60U | kN | std::uint64_t{2} << 50U)) << "N³";
}

TEST(IgtlMessage, HeadersAndBodiesThatAreWrongAreNotRead) {
  const Buffer good = transform("rightTarget", Vec3(1, 2, 3));
  const auto spoiled = [&](std::size_t at, std::uint8_t value) {
    Buffer message = good;
    message.at(at) = static_cast<std::byte>(value);
    return message;
  };
  EXPECT_FALSE(read_header(spoiled(1, 0))) << "version 0";
  EXPECT_FALSE(read_header(spoiled(0, 1))) << "version 257";
  EXPECT_TRUE(read_header(spoiled(1, 2))) << "version 2 is a header; the Session refuses its body";
  EXPECT_FALSE(read_header(spoiled(2, 0))) << "no type";
  EXPECT_FALSE(read_header(spoiled(3, 7))) << "a type that cannot be printed";
  ASSERT_TRUE(read_header(spoiled(15, 0xff)));
  EXPECT_EQ(read_header(spoiled(15, 0xff))->name, "") << "a name that is not ASCII is that of no station";
  EXPECT_FALSE(read_position(Bytes(good).subspan(kHeaderSize + 1)));
  EXPECT_FALSE(read_position({}));
  EXPECT_FALSE(read_force({}));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 10001.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_FALSE(read_position(Bytes(transform("a", bad * Vec3::Unit(axis))).subspan(kHeaderSize))) << bad;
    }
  }
  EXPECT_FALSE(read_force(Bytes(sensor("a", Vec3(0, 0, 2e12))).subspan(kHeaderSize)));
  EXPECT_FALSE(read_force(Bytes(sensor("a", Vec3(std::nan(""), 0, 0))).subspan(kHeaderSize)));
  Buffer two = sensor("a", Vec3(1, 2, 3));
  put(two, kHeaderSize, std::uint8_t{2});
  EXPECT_FALSE(read_force(Bytes(two).subspan(kHeaderSize))) << "a count that lies";
}

}  // namespace
}  // namespace tendon::bridge::igtl::igtl_message_test
