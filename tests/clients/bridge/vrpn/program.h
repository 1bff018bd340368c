// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/bridge/vrpn/vrpn_message.h"

// The bytes that a VRPN program sends, according to VRPN.md.

namespace tendon::bridge::vrpn {

inline void put(Buffer& out, std::uint64_t value, int bytes) {
  for (int i = bytes - 1; i >= 0; --i) out.push_back(static_cast<std::byte>(value >> (8 * i) & 0xffU));
}

inline Buffer floats(std::initializer_list<double> values) {
  Buffer out;
  for (const double one : values) put(out, std::bit_cast<std::uint32_t>(static_cast<float>(one)), 4);
  return out;
}

inline Buffer field_payload(const ForceField& field) {
  const Mat3& j = field.jacobian;
  return floats({field.origin.x(), field.origin.y(), field.origin.z(), field.force.x(), field.force.y(),
                 field.force.z(), j(0, 0), j(0, 1), j(0, 2), j(1, 0), j(1, 1), j(1, 2), j(2, 0), j(2, 1), j(2, 2),
                 field.radius});
}

inline Buffer plane_payload(const Plane& plane) {
  Buffer out = floats({plane.normal.x(), plane.normal.y(), plane.normal.z(), plane.offset, plane.spring, plane.damping,
                       plane.dynamic_friction, plane.static_friction});
  put(out, static_cast<std::uint32_t>(plane.index), 4);
  put(out, 1, 4);
  return out;
}

/// This sender has its own numbering. It is sender 5, and its types start at 100 in the order of `Type`.
class Program {
 public:
  static constexpr std::int32_t kSender = 5;
  static constexpr std::int32_t kFirstType = 100;

  Buffer hello() const {
    const auto bytes = cookie();
    return {bytes.begin(), bytes.end()};
  }
  static Buffer message(std::int32_t sender, std::int32_t type, const Buffer& payload = {}) {
    Buffer out;
    append(out, {.stamp = {}, .sender = sender, .type = type, .payload = payload}, 0);
    return out;
  }
  static Buffer description(std::int32_t number, std::int32_t type, std::string_view name) {
    Buffer payload;
    append_description(payload, name);
    return message(number, type, payload);
  }
  static Buffer all_types(std::int32_t first = kFirstType) {
    Buffer out;
    for (std::size_t i = 0; i < kTypeNames.size(); ++i) {
      const Buffer one = description(first + static_cast<std::int32_t>(i), kTypeDescription, kTypeNames[i]);
      out.insert(out.end(), one.begin(), one.end());
    }
    return out;
  }
  static Buffer say(Type type, const Buffer& payload = {}) {
    return message(kSender, kFirstType + static_cast<std::int32_t>(type), payload);
  }
  static Buffer draw(const ForceField& field) { return say(Type::kForceField, field_payload(field)); }
  static Buffer draw(const Plane& plane) { return say(Type::kPlane, plane_payload(plane)); }
};

struct Said {
  std::string sender;
  std::string type;
  Buffer payload;
  double number(std::size_t at) const {  ///< the f64 at this byte offset
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 8; ++i) bits = bits << 8U | std::to_integer<std::uint64_t>(payload.at(at + i));
    return std::bit_cast<double>(bits);
  }
  std::uint32_t whole(std::size_t at) const {
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8U | std::to_integer<std::uint32_t>(payload.at(at + i));
    return value;
  }
};

class Reader {
 public:
  std::vector<Said> take(Bytes bytes, bool has_cookie = false) {
    if (has_cookie) bytes = bytes.subspan(kCookieSize);
    std::vector<Said> all;
    while (!bytes.empty()) {
      const First first = first_message(bytes);
      if (!first.message) throw std::runtime_error("a message of ours is broken");
      bytes = bytes.subspan(first.size);
      const Message& one = *first.message;
      if (one.type == kSenderDescription || one.type == kTypeDescription) {
        auto& names = one.type == kSenderDescription ? senders_ : types_;
        const auto at = static_cast<std::size_t>(one.sender);
        if (at >= names.size()) names.resize(at + 1);
        names[at] = std::string(read_description(one.payload).value());
      } else if (one.type >= 0) {
        all.push_back({senders_.at(static_cast<std::size_t>(one.sender)),
                       types_.at(static_cast<std::size_t>(one.type)),
                       {one.payload.begin(), one.payload.end()}});
      }
    }
    return all;
  }

 private:
  std::vector<std::string> senders_;
  std::vector<std::string> types_;
};

}  // namespace tendon::bridge::vrpn
