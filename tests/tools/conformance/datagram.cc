// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/datagram.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace tendon::conformance {
namespace {

constexpr std::size_t kHelloBodyAt = 50;

void put_little_endian(Bytes& out, std::uint64_t value, int size) {
  for (int i = 0; i < size; ++i) out.push_back(static_cast<std::byte>(value >> (8 * i)));
}

std::uint64_t little_endian(Span bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | std::to_integer<std::uint64_t>(bytes[i]);
  return value;
}

std::uint8_t number_of(std::byte byte) { return std::to_integer<std::uint8_t>(byte); }

}  // namespace

Bytes write(const Head& head) {
  Bytes out;
  out.push_back(std::byte{head.magic});
  out.push_back(static_cast<std::byte>(head.version << 4U | head.type));
  out.push_back(std::byte{head.epoch});
  out.push_back(std::byte{head.suite});
  put_little_endian(out, head.connection_id, 4);
  put_little_endian(out, head.number, 8);
  return out;
}

std::optional<Head> read_head(Span datagram) {
  if (datagram.size() < kHeadSize) return std::nullopt;
  const std::uint8_t kind = number_of(datagram[1]);
  return Head{.magic = number_of(datagram[0]),
              .version = static_cast<std::uint8_t>(kind >> 4U),
              .type = static_cast<std::uint8_t>(kind & 0xFU),
              .epoch = number_of(datagram[2]),
              .suite = number_of(datagram[3]),
              .connection_id = static_cast<std::uint32_t>(little_endian(datagram.subspan(4, 4))),
              .number = little_endian(datagram.subspan(8, 8))};
}

Bytes hello(std::uint8_t suite, const Sixteen& random, const Sixteen& cookie, Span body) {
  Bytes out = write({.type = kHelloType, .suite = suite}) + random + cookie;
  put_little_endian(out, body.size(), 2);
  out = std::move(out) + body;
  out.resize(std::max(kLargest, kHelloBodyAt + body.size()));
  return out;
}

Bytes retry(std::uint8_t suite, const Sixteen& random, const Sixteen& cookie) {
  return write({.type = kRetryType, .suite = suite}) + random + cookie;
}

Bytes answer(std::uint8_t suite, std::uint32_t connection_id, const Sixteen& random, Span body) {
  return write({.type = kAnswerType, .suite = suite, .connection_id = connection_id}) + random + body;
}

Sixteen sixteen(Span datagram, std::size_t at) {
  Sixteen out{};
  if (datagram.size() >= at + out.size()) std::ranges::copy(datagram.subspan(at, out.size()), out.begin());
  return out;
}

Bytes operator+(Bytes a, Span b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

Bytes bytes_of(std::string_view text) {
  const Span bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

Bytes bytes_of(const google::protobuf::MessageLite& message) {
  std::string text;
  message.SerializePartialToString(&text);
  return bytes_of(text);
}

bool read(Span bytes, google::protobuf::MessageLite& message) {
  return message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

bool far(double value) { return !(std::abs(value) <= 1e12); }
bool far(const pb::Vec3& vector) { return far(vector.x()) || far(vector.y()) || far(vector.z()); }

namespace {

bool any_far(const google::protobuf::RepeatedField<double>& values) {
  return std::ranges::any_of(values, [](double value) { return far(value); });
}

bool within_bounds(const pb::Contact& contact) {
  const pb::Vec3& n = contact.normal();
  const pb::ForceTable& table = contact.table();
  const int entries = table.force_n_size();
  return std::abs(std::hypot(n.x(), n.y(), n.z()) - 1) <= 1e-3 && !far(contact.gap_m()) &&
         (!contact.has_table() || (entries >= 2 && entries <= 16 && !any_far(table.force_n()) &&
                                   !far(table.first_depth_m()) && !far(table.step_m()) && table.step_m() > 0));
}

bool within_bounds(const pb::LocalModel& model) {
  const int entries = model.stiffness_npm_size();
  const double radius = model.valid_radius_m();
  return !far(model.at_m()) && (entries == 1 || entries == 3 || entries == 9) && !any_far(model.stiffness_npm()) &&
         (!far(radius) || std::isinf(radius)) && radius >= 0 &&
         (!model.has_contact() || within_bounds(model.contact()));
}

}  // namespace

bool within_bounds(const pb::ForceCommand& force) {
  return !far(force.force_n()) && force.valid_for_us() >= 1 && force.valid_for_us() <= 10'000'000 &&
         (!force.has_model() || within_bounds(force.model())) && !far(force.error_n()) && force.error_n() >= 0 &&
         force.way() <= 8;
}

std::string hex(Span bytes, std::size_t most) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out;
  for (const std::byte byte : bytes.first(std::min(most, bytes.size()))) {
    if (!out.empty()) out += ' ';
    out += kDigits[number_of(byte) >> 4U];
    out += kDigits[number_of(byte) & 0xFU];
  }
  if (bytes.size() > most) out += " … (" + std::to_string(bytes.size()) + " bytes)";
  return out;
}

Bytes from_hex(std::string_view digits) {
  Bytes out;
  int high = -1;
  for (const char c : digits) {
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0) continue;
    const int value = c <= '9' ? c - '0' : (c | 0x20) - 'a' + 10;
    if (high < 0) {
      high = value;
    } else {
      out.push_back(static_cast<std::byte>(high << 4 | value));
      high = -1;
    }
  }
  return out;
}

}  // namespace tendon::conformance
