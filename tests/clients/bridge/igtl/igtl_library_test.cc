// SPDX-License-Identifier: Apache-2.0
// Compares the codec with the library libopenigtlink 1.11, in both directions.
#include <gtest/gtest.h>
#include <openigtlink/igtlSensorMessage.h>
#include <openigtlink/igtlStatusMessage.h>
#include <openigtlink/igtlStringMessage.h>
#include <openigtlink/igtlTransformMessage.h>
#include <openigtlink/igtlUnit.h>

#include <chrono>
#include <cstring>
#include <string>
#include <vector>

#include "clients/bridge/igtl/igtl_message.h"
#include "protocol/frames.h"
#include "protocol/rotation.h"
#include "tests/support/dice.h"

namespace tendon::bridge::igtl::igtl_library_test {
namespace {

constexpr int kMessages = 1000;

/// Reads a message of ours with the library, which also checks the CRC.
template <class Message>
typename Message::Pointer read_by_library(const Buffer& bytes) {
  auto header = ::igtl::MessageHeader::New();
  header->InitPack();
  std::memcpy(header->GetPackPointer(), bytes.data(), kHeaderSize);
  header->Unpack();
  auto message = Message::New();
  message->SetMessageHeader(header);
  message->AllocatePack();
  EXPECT_EQ(static_cast<std::size_t>(message->GetPackBodySize()), bytes.size() - kHeaderSize);
  std::memcpy(message->GetPackBodyPointer(), bytes.data() + kHeaderSize, bytes.size() - kHeaderSize);
  EXPECT_TRUE(message->Unpack(1) & ::igtl::MessageHeader::UNPACK_BODY) << "the CRC";
  return message;
}

struct Read {
  Header header;
  Buffer bytes;
  Bytes body() const { return Bytes(bytes).subspan(kHeaderSize); }
};
template <class Message>
Read packed_by_library(Message& message) {
  message.Pack();
  const auto* const begin = static_cast<const std::byte*>(message.GetPackPointer());
  Read read{{}, Buffer(begin, begin + message.GetPackSize())};
  const auto header = read_header(read.bytes);
  EXPECT_TRUE(header);
  read.header = header.value_or(Header{});
  EXPECT_EQ(read.header.version, 1);
  EXPECT_EQ(read.header.crc, crc64(read.body()));
  EXPECT_EQ(read.header.body_size, read.body().size());
  return read;
}

Vec3 any_vector(Dice& dice, double length) { return dice.within(0, length) * dice.direction(); }

TEST(IgtlLibrary, ReadsOurTransformsSensorsStatusesAndStrings) {
  Dice dice(1);
  for (int i = 0; i < kMessages; ++i) {
    const Vec3 place = any_vector(dice, 500);
    const Mat3 rotation = matrix_of(rotation_by(any_vector(dice, 3)));
    const Label label{"right", std::chrono::seconds(1'700'000'000 + i) + std::chrono::milliseconds(250)};
    Buffer bytes;
    append_transform(bytes, label, rotation, place);
    const auto transform = read_by_library<::igtl::TransformMessage>(bytes);
    EXPECT_STREQ(transform->GetDeviceName(), "right");
    ::igtl::Matrix4x4 matrix;
    transform->GetMatrix(matrix);
    for (Eigen::Index row = 0; row < 3; ++row) {
      EXPECT_EQ(matrix[row][3], static_cast<float>(place[row]));
      for (Eigen::Index column = 0; column < 3; ++column) {
        EXPECT_EQ(matrix[row][column], static_cast<float>(rotation(row, column)));
      }
    }
    unsigned int seconds = 0, fraction = 0;
    transform->GetTimeStamp(&seconds, &fraction);
    EXPECT_EQ(seconds, 1'700'000'000U + static_cast<unsigned>(i));
    EXPECT_EQ(fraction, 0x40000000U) << "a quarter, in 2⁻³² s";

    bytes.clear();
    append_force(bytes, label, place);
    const auto sensor = read_by_library<::igtl::SensorMessage>(bytes);
    ASSERT_EQ(sensor->GetLength(), 3U);
    for (unsigned k = 0; k < 3; ++k) EXPECT_EQ(sensor->GetValue(k), place[k]);
    auto newton = ::igtl::Unit::New();
    newton->Append(::igtl::Unit::SI_DERIVED_NEWTON, 1);
    EXPECT_EQ(sensor->GetUnit(), newton->Pack());

    bytes.clear();
    append_status(bytes, label, Status::kDisabled, "number " + std::to_string(i));
    const auto status = read_by_library<::igtl::StatusMessage>(bytes);
    EXPECT_EQ(status->GetCode(), static_cast<int>(::igtl::StatusMessage::STATUS_DISABLED));
    EXPECT_EQ(status->GetStatusString(), "number " + std::to_string(i));

    bytes.clear();
    append_string(bytes, label, "number " + std::to_string(i));
    EXPECT_EQ(read_by_library<::igtl::StringMessage>(bytes)->GetString(), "number " + std::to_string(i));
  }
}

TEST(IgtlLibrary, ItsTransformsAndSensorsAreRead) {
  Dice dice(2);
  auto transform = ::igtl::TransformMessage::New();
  transform->SetDeviceName("rightTarget");
  auto sensor = ::igtl::SensorMessage::New();
  sensor->SetDeviceName("rightCommand");
  sensor->SetLength(3);
  for (int i = 0; i < kMessages; ++i) {
    const Vec3 place = any_vector(dice, 500);
    ::igtl::Matrix4x4 matrix;
    ::igtl::IdentityMatrix(matrix);
    for (Eigen::Index row = 0; row < 3; ++row) matrix[row][3] = static_cast<float>(place[row]);
    transform->SetMatrix(matrix);
    const Read target = packed_by_library(*transform);
    EXPECT_EQ(target.header.type, kTransform);
    EXPECT_EQ(target.header.name, "rightTarget");
    EXPECT_EQ(read_position(target.body()).value_or(Vec3::Zero()), place.cast<float>().cast<double>());

    auto unit = ::igtl::Unit::New();
    unit->Append(::igtl::Unit::SI_DERIVED_NEWTON, 1);
    if (i % 2 == 1) unit->SetPrefix(::igtl::Unit::SI_PREFIX_MILLI);
    sensor->SetUnit(unit->Pack());
    for (unsigned k = 0; k < 3; ++k) sensor->SetValue(k, place[k]);
    const Read force = packed_by_library(*sensor);
    EXPECT_EQ(force.header.type, kSensor);
    EXPECT_TRUE(read_force(force.body()).value_or(Vec3::Zero()).isApprox(place * (i % 2 == 1 ? 1e-3 : 1), 1e-12));
  }
}

}  // namespace
}  // namespace tendon::bridge::igtl::igtl_library_test
