// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// How a server is found by name: DNS-SD (RFC 6763), service _tendon._udp, one instance for each device. This file has
/// the names and texts; server/machine/announcer.h announces, clients/cpp/discovery looks.
///
/// Anybody can announce any name. An instance says where to knock; who answers is told by the key alone (SESSION.md).
///
/// Thread-safe. Realtime-safe: no (heap).
namespace tendon::dns_sd {

inline constexpr const char* kService = "_tendon._udp";
inline constexpr const char* kLocal = "local";
/// Bytes of an instance's name, one label of DNS.
inline constexpr std::size_t kMaxName = 63;

/// Whether an instance can have this name: 1 to 63 bytes of UTF-8 without control characters (RFC 6763, 4.1.1).
bool is_instance_name(std::string_view name) noexcept;

/// Whether `name` is one of a domain or a host: labels of 1 to 63 letters, digits, - and _, with dots between them.
bool is_domain(std::string_view name) noexcept;

/// The name to try when `name` is taken for the `attempt`-th time (from 2 on): "falcon at bench 3 #2". A long one is
/// cut, so that 63 bytes are enough.
std::string another_name(const std::string& name, int attempt);

/// One instance: "falcon at bench 3" of the domain "local", which multicast answers for on the local network; for every
/// other domain name servers do.
struct Instance {
  std::string name;  ///< as is_instance_name(); empty: all of the domain
  std::string domain = kLocal;
  bool operator==(const Instance&) const = default;
};

/// Reads "NAME", "NAME.DOMAIN", and, for all of a domain, "" or ".DOMAIN". The name ends at the first dot; a dot in it
/// is written "\.", a backslash "\\", any byte "\DDD" in decimals, as in zone files. Throws std::invalid_argument:
/// `expected NAME or NAME.DOMAIN like "falcon at bench 3", got "…": …`.
Instance parse_instance(std::string_view text);

/// What parse_instance() reads; the domain is left out when it is "local".
std::string to_string(const Instance& instance);

/// As DNS asks for it: "falcon at bench 3._tendon._udp.example.org"; without a name "_tendon._udp.example.org".
std::string full_name(const Instance& instance);

/// What a server says of a device in the TXT record of its instance. No key, and no person's name.
struct About {
  std::uint32_t version = 0;            ///< "v": of the wire; 0: not said
  std::string device;                   ///< as clients claim it; empty: not said
  std::uint32_t hz = 0;                 ///< haptic steps per second; 0: not said
  std::uint32_t suite = 0;              ///< 1: only who has a key is let in
  std::vector<std::string> channels{};  ///< at most limits::kMaxChannels
  bool operator==(const About&) const = default;
};

/// The strings of the record: "v=1", "device=falcon", "hz=1000", "suite=1", "channels=main,tissue".
std::vector<std::string> to_txt(const About& about);

/// Reads such strings from anybody. What is not as to_txt() writes it counts as not said; of a key that comes twice the
/// first counts; the case of keys does not matter (RFC 6763, 6.4).
About read_txt(std::span<const std::string> strings);

/// The strings in the data of a TXT record: each has its length in front. A string that is cut ends the list.
std::vector<std::string> split_txt(std::span<const std::byte> data);

}  // namespace tendon::dns_sd
