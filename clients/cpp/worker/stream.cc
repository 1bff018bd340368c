// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/worker/stream.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <variant>

#include "protocol/link.h"
#include "protocol/secrets/crypto.h"

namespace tendon::worker {
namespace {

constexpr std::size_t kLengthBytes = 4;
constexpr std::size_t kSequenceBytes = 8;

template <std::size_t kBytes>
std::uint64_t read_little_endian(const std::byte* from) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < kBytes; ++i) value |= std::to_integer<std::uint64_t>(from[i]) << (8 * i);
  return value;
}

template <std::size_t kBytes>
void append_little_endian(std::uint64_t value, std::vector<std::byte>& to) {
  for (std::size_t i = 0; i < kBytes; ++i) to.push_back(static_cast<std::byte>(value >> (8 * i)));
}

template <class Value>
const Value* only_frame(const DataContent* content) {
  return content != nullptr && content->frames.size() == 1 ? std::get_if<Value>(&content->frames.front()) : nullptr;
}

}  // namespace

std::vector<std::byte> to_bytes(const Record& record) {
  std::vector<std::byte> bytes;
  bytes.reserve(kLengthBytes + kSequenceBytes + record.body.size());
  append_little_endian<kLengthBytes>(kSequenceBytes + record.body.size(), bytes);
  append_little_endian<kSequenceBytes>(record.sequence, bytes);
  bytes.insert(bytes.end(), record.body.begin(), record.body.end());
  return bytes;
}

std::optional<Record> RecordReader::next() {
  if (bytes_.size() < kLengthBytes) return std::nullopt;
  const auto length = static_cast<std::size_t>(read_little_endian<kLengthBytes>(bytes_.data()));
  if (length < kSequenceBytes || length > kSequenceBytes + kMaxDatagram) {
    throw std::runtime_error("a record of " + std::to_string(length) + " bytes: expected " +
                             std::to_string(kSequenceBytes) + " to " + std::to_string(kSequenceBytes + kMaxDatagram));
  }
  if (bytes_.size() < kLengthBytes + length) return std::nullopt;
  const auto body = bytes_.begin() + kLengthBytes + kSequenceBytes;
  const auto end = bytes_.begin() + static_cast<std::ptrdiff_t>(kLengthBytes + length);
  Record record{.sequence = read_little_endian<kSequenceBytes>(bytes_.data() + kLengthBytes), .body = {body, end}};
  bytes_.erase(bytes_.begin(), end);
  return record;
}

Record opening(std::string_view secret) {
  Record record;
  for (const std::string_view part : {kOpeningMagic, secret}) {
    for (const char c : part) record.body.push_back(static_cast<std::byte>(c));
  }
  return record;
}

bool opens(const Record& record, std::string_view secret) {
  return record.sequence == 0 && crypto::equal(record.body, opening(secret).body);
}

template <class Frame>
Record Codec::record_of(std::uint64_t sequence, const Frame* frame) {
  std::array<std::byte, kHeaderSize + kMaxDatagram> buffer;
  writer_.begin(buffer, Header{}, LocalTime{}, std::nullopt);
  if (frame != nullptr) writer_.add(*frame);
  return {.sequence = sequence,
          .body = {buffer.begin() + kHeaderSize, buffer.begin() + static_cast<std::ptrdiff_t>(writer_.size())}};
}

Record Codec::state(std::uint64_t sequence, const DeviceState& hand) { return record_of(sequence, &hand); }

std::optional<DeviceState> Codec::read_state(const Record& record) {
  const auto* state = only_frame<DeviceState>(reader_.read(record.body));
  return state != nullptr ? std::optional(*state) : std::nullopt;
}

Record Codec::answer(std::uint64_t sequence, const DeviceState& hand, const Touch& touch) {
  if (touch.unknown) return record_of<ForceCommand>(sequence, nullptr);
  ForceCommand command = to_command(touch, hand);
  command.sequence = sequence;
  command.valid_for = touch.valid_for.value_or(limits::kMaxValidFor);
  return record_of(sequence, &command);
}

Codec::ReadAnswer Codec::read_answer(const Record& record, std::uint64_t sequence, const DeviceState& hand) {
  if (record.sequence != sequence) return {.refused = "it answers a state that was not requested"};
  const DataContent* const content = reader_.read(record.body);
  if (content == nullptr) return {.refused = "it is not a Datagram"};
  if (content->forces_not_finite > 0) return {.refused = "it contains a number that is not finite"};
  if (content->forces_out_of_bounds > 0) return {.refused = "it contains a value that is out of bounds"};
  if (content->frames.empty() && content->invalid == 0) {
    Touch unknown;
    unknown.unknown = true;
    return {.touch = unknown};
  }
  const auto* command = only_frame<ForceCommand>(content);
  if (command == nullptr) return {.refused = "it does not contain exactly one force"};
  if (command->based_on_tick != hand.tick || command->sequence != sequence) {
    return {.refused = "its force answers another state"};
  }
  return {.touch = to_touch(*command)};
}

}  // namespace tendon::worker
