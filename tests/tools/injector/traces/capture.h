// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"

namespace tendon::injector {

/// A UDP datagram of a capture.
struct CapturedDatagram {
  Duration at{};  ///< since 1970, on the clock of the tap
  std::uint16_t source = 0;
  std::uint16_t destination = 0;
  std::uint64_t payload_hash = 0;  ///< see trace.h
  std::uint32_t size = 0;          ///< bytes of the payload on the wire
  bool cut = false;                ///< the capture only contains a part of it (snapshot length)
};

/// An ICMP echo request or reply.
struct CapturedEcho {
  Duration at{};
  bool reply = false;
  std::uint16_t id = 0;
  std::uint16_t sequence = 0;
  std::uint32_t size = 0;
};

/// What the importers use of a capture, in the order of the file.
struct Capture {
  std::vector<CapturedDatagram> datagrams;
  std::vector<CapturedEcho> echoes;
  std::optional<Duration> first, last;  ///< times of all packets
  std::size_t fragments = 0;            ///< of IP packets, which are skipped
  std::size_t tcp = 0;                  ///< packets
  std::size_t others = 0;               ///< packets that are not IPv4, IPv6, or of another protocol
  bool truncated = false;               ///< the file ends within a packet, which is skipped
};

inline constexpr std::size_t kMaxCapturedPackets = 20'000'000;

/// Reads a capture by tcpdump, dumpcap or Wireshark: pcap with µs or ns in both byte orders (draft-ietf-opsawg-pcap), or
/// pcapng with the option if_tsresol (draft-ietf-opsawg-pcapng). Only Enhanced Packet Blocks have a time, so other packet
/// blocks are skipped. Link types: 0 (null), 1 (Ethernet with VLAN tags), 101 (raw), 113 and 276 (Linux cooked).
/// IPv4 and IPv6 with UDP or ICMP; IPv6 extension headers are not followed.
///
/// Throws std::runtime_error that begins with `name` if the file is no such capture, a block is inconsistent, or a link
/// type is unknown.
Capture read_capture(std::istream& from, const std::string& name);

}  // namespace tendon::injector
