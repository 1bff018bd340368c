// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/traces/capture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <stdexcept>
#include <utility>

#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector {
namespace {

using Bytes = std::span<const std::byte>;

constexpr std::size_t kMostBytes = 256 * 1024;  // of a packet or block

/// The number in `size` bytes at `at`, which must exist.
std::uint32_t number(Bytes bytes, std::size_t at, std::size_t size, bool big_endian) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const std::size_t place = big_endian ? at + i : at + size - 1 - i;
    value = value << 8 | std::to_integer<std::uint32_t>(bytes[place]);
  }
  return value;
}

/// In network byte order.
std::uint16_t u16(Bytes bytes, std::size_t at) { return static_cast<std::uint16_t>(number(bytes, at, 2, true)); }

enum LinkType : std::uint32_t { kNull = 0, kEthernet = 1, kRaw = 101, kCooked = 113, kCooked2 = 276 };

/// The length of the link header, or nullopt if it is cut off. `known` is false for an unknown link type.
std::optional<std::size_t> link_header(Bytes packet, std::uint32_t link, bool& known) {
  known = true;
  std::size_t length = 0;
  switch (link) {
    case kNull:
      length = 4;
      break;
    case kEthernet:
      length = 14;
      while (packet.size() >= length + 4) {
        const std::uint16_t type = u16(packet, length - 2);
        if (type != 0x8100 && type != 0x88A8) break;  // a VLAN tag
        length += 4;
      }
      break;
    case kRaw:
      break;
    case kCooked:
      length = 16;
      break;
    case kCooked2:
      length = 20;
      break;
    default:
      known = false;
  }
  if (!known || packet.size() < length) return std::nullopt;
  return length;
}

class Reader {
 public:
  Reader(std::istream& from, const std::string& name) : from_(from), name_(name) {}

  Capture read() && {
    std::array<std::byte, 4> magic{};
    if (!fill(magic)) refuse("expected a capture (pcap or pcapng), found less than 4 bytes");
    switch (number(magic, 0, 4, true)) {
      case 0xA1B2C3D4:
        pcap(true, 1000);
        break;
      case 0xD4C3B2A1:
        pcap(false, 1000);
        break;
      case 0xA1B23C4D:
        pcap(true, 1);
        break;
      case 0x4D3CB2A1:
        pcap(false, 1);
        break;
      case 0x0A0D0D0A:
        pcapng();
        break;
      default:
        refuse("expected a capture (pcap or pcapng), found another file");
    }
    return std::move(capture_);
  }

 private:
  struct Interface {
    std::uint32_t link = 0;
    std::uint64_t ticks_per_s = 1'000'000;
  };

  [[noreturn]] void refuse(const std::string& sentence) const { throw std::runtime_error(name_ + ": " + sentence); }

  /// Returns false at the end of the file, which is within a packet if some bytes were read.
  bool fill(std::span<std::byte> bytes) {
    from_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    const auto count = static_cast<std::size_t>(from_.gcount());
    offset_ += count;
    if (from_.bad()) refuse("cannot read the file");
    if (count == bytes.size()) return true;
    capture_.truncated = capture_.truncated || count > 0;
    return false;
  }

  /// Reads `size` bytes into the buffer.
  std::optional<Bytes> take(std::size_t size) {
    if (size > kMostBytes) {
      refuse("expected at most " + std::to_string(kMostBytes) + " bytes for a packet at byte " +
             std::to_string(offset_) + ", found " + std::to_string(size));
    }
    buffer_.resize(size);
    if (size > 0 && !fill(buffer_)) {
      capture_.truncated = true;
      return std::nullopt;
    }
    return buffer_;
  }

  void pcap(bool big_endian, std::uint32_t ns_per_tick) {
    const auto header = take(20);
    if (!header) return;
    const std::uint32_t link = number(*header, 16, 4, big_endian) & 0xFFFF;
    while (const auto packet = take(16)) {
      const auto field = [&](std::size_t i) { return number(*packet, 4 * i, 4, big_endian); };
      const Duration at = std::chrono::seconds(field(0)) + Duration(std::int64_t{field(1)} * ns_per_tick);
      const std::uint32_t size = field(2);
      const std::uint32_t on_the_wire = field(3);
      const auto bytes = take(size);
      if (!bytes) return;
      add(at, link, *bytes, on_the_wire);
    }
    capture_.truncated = from_.gcount() > 0;
  }

  void pcapng() {
    bool big_endian = false;
    std::vector<Interface> interfaces;
    std::uint32_t type = 0x0A0D0D0A;
    for (bool first = true; first || next_type(type, big_endian); first = false) {
      const auto raw_length = take(4);
      if (!raw_length) return;
      std::array<std::byte, 4> length_bytes{};
      std::ranges::copy(*raw_length, length_bytes.begin());
      std::size_t read = 8;
      if (type == 0x0A0D0D0A) {
        const auto order = take(4);
        if (!order) return;
        read += 4;
        const std::uint32_t magic = number(*order, 0, 4, true);
        if (magic != 0x1A2B3C4D && magic != 0x4D3C2B1A) refuse("expected the byte order of a section");
        big_endian = magic == 0x1A2B3C4D;
        interfaces.clear();
      }
      const std::uint32_t length = number(length_bytes, 0, 4, big_endian);
      if (length < read + 4 || length % 4 != 0) {
        refuse("expected a block of at least " + std::to_string(read + 4) + " bytes at byte " +
               std::to_string(offset_ - read) + ", found " + std::to_string(length));
      }
      const auto block = take(length - read);
      if (!block) return;
      const Bytes body = block->first(block->size() - 4);
      if (type == 1) interfaces.push_back(interface_of(body, big_endian));
      if (type == 6) enhanced(body, interfaces, big_endian);
    }
  }

  bool next_type(std::uint32_t& type, bool big_endian) {
    std::array<std::byte, 4> bytes{};
    if (!fill(bytes)) return false;
    type = number(bytes, 0, 4, big_endian);
    return true;
  }

  Interface interface_of(Bytes body, bool big_endian) const {
    if (body.size() < 8) refuse("expected at least 8 bytes in the description of an interface");
    Interface interface { .link = number(body, 0, 2, big_endian) };
    for (std::size_t at = 8; at + 4 <= body.size();) {
      const std::uint32_t code = number(body, at, 2, big_endian);
      const std::size_t size = number(body, at + 2, 2, big_endian);
      if (code == 0 || at + 4 + size > body.size()) break;
      constexpr std::uint32_t kResolution = 9;
      if (code == kResolution && size >= 1) {
        const auto value = std::to_integer<unsigned>(body[at + 4]);
        const unsigned exponent = value & 0x7F;
        const std::uint64_t base = (value & 0x80) != 0 ? 2 : 10;
        interface.ticks_per_s = 1;
        for (unsigned i = 0; i < exponent; ++i) {
          constexpr std::uint64_t kMostTicks = 1'000'000'000'000;  // picoseconds
          interface.ticks_per_s *= base;
          if (interface.ticks_per_s > kMostTicks) refuse("expected a resolution of time of at most 1e-12 s");
        }
      }
      at += 4 + (size + 3) / 4 * 4;
    }
    return interface;
  }

  void enhanced(Bytes body, const std::vector<Interface>& interfaces, bool big_endian) {
    if (body.size() < 20) refuse("expected at least 20 bytes in a packet block");
    const auto field = [&](std::size_t i) { return number(body, 4 * i, 4, big_endian); };
    const std::uint32_t index = field(0);
    if (index >= interfaces.size()) refuse("expected the description of interface " + std::to_string(index));
    const std::uint64_t ticks = std::uint64_t{field(1)} << 32 | field(2);
    const std::uint64_t rate = interfaces[index].ticks_per_s;
    const std::uint64_t whole = ticks / rate;
    constexpr std::uint64_t kMostSeconds = 9'000'000'000;  // fits into 64 bits of nanoseconds
    if (whole > kMostSeconds) refuse("expected a time before the year 2255");
    const auto rest = std::llround(static_cast<double>(ticks % rate) * 1e9 / static_cast<double>(rate));
    const std::size_t size = field(3);
    if (size > body.size() - 20) refuse("expected " + std::to_string(size) + " bytes of a packet in its block");
    add(std::chrono::seconds(whole) + Duration(rest), interfaces[index].link, body.subspan(20, size), field(4));
  }

  void add(Duration at, std::uint32_t link, Bytes packet, std::uint32_t on_the_wire) {
    if (++packets_ > kMaxCapturedPackets) {
      refuse("expected at most " + std::to_string(kMaxCapturedPackets) + " packets");
    }
    capture_.first = std::min(capture_.first.value_or(at), at);
    capture_.last = std::max(capture_.last.value_or(at), at);
    bool known = false;
    const auto header = link_header(packet, link, known);
    if (!known) {
      refuse("expected a link type of 0, 1, 101, 113 or 276, found " + std::to_string(link));
    }
    if (header) {
      ip(at, packet.subspan(*header), on_the_wire > packet.size());
    } else {
      ++capture_.others;
    }
  }

  void ip(Duration at, Bytes packet, bool cut) {
    constexpr unsigned kIcmp = 1, kTcp = 6, kUdp = 17, kIcmpV6 = 58;
    const unsigned version = packet.empty() ? 0 : std::to_integer<unsigned>(packet[0]) >> 4;
    std::size_t header = 0;
    unsigned protocol = 0;
    if (version == 4 && packet.size() >= 20) {
      header = (std::to_integer<std::size_t>(packet[0]) & 15) * 4;
      protocol = std::to_integer<unsigned>(packet[9]);
      if ((u16(packet, 6) & 0x3FFF) != 0) {
        ++capture_.fragments;
        return;
      }
    } else if (version == 6 && packet.size() >= 40) {
      constexpr unsigned kFragment = 44;
      header = 40;
      protocol = std::to_integer<unsigned>(packet[6]);
      if (protocol == kFragment) {
        ++capture_.fragments;
        return;
      }
    }
    if (protocol == kTcp) ++capture_.tcp;
    const bool echo = (version == 4 && protocol == kIcmp) || (version == 6 && protocol == kIcmpV6);
    if (header < 20 || packet.size() < header + 8 || !(protocol == kUdp || echo)) {
      if (protocol != kTcp) ++capture_.others;
      return;
    }
    const Bytes body = packet.subspan(header);
    if (protocol == kUdp) {
      udp(at, body, cut);
    } else {
      icmp(at, body, version);
    }
  }

  void udp(Duration at, Bytes body, bool cut) {
    const std::size_t length = u16(body, 4);
    if (length < 8) {
      ++capture_.others;
      return;
    }
    // Ethernet pads short packets.
    const Bytes payload = body.subspan(8, std::min(length, body.size()) - 8);
    capture_.datagrams.push_back({.at = at,
                                  .source = u16(body, 0),
                                  .destination = u16(body, 2),
                                  .payload_hash = payload_hash(payload),
                                  .size = static_cast<std::uint32_t>(length - 8),
                                  .cut = cut && body.size() < length});
  }

  void icmp(Duration at, Bytes body, unsigned version) {
    const auto type = std::to_integer<unsigned>(body[0]);
    const unsigned request = version == 4 ? 8 : 128;
    const unsigned reply = version == 4 ? 0 : 129;
    if (type != request && type != reply) {
      ++capture_.others;
      return;
    }
    capture_.echoes.push_back({.at = at,
                               .reply = type == reply,
                               .id = u16(body, 4),
                               .sequence = u16(body, 6),
                               .size = static_cast<std::uint32_t>(body.size())});
  }

  std::istream& from_;
  const std::string& name_;
  Capture capture_;
  std::vector<std::byte> buffer_;
  std::size_t offset_ = 0;
  std::size_t packets_ = 0;
};

}  // namespace

Capture read_capture(std::istream& from, const std::string& name) { return Reader(from, name).read(); }

}  // namespace tendon::injector
