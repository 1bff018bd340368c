// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Names and TXT records for finding servers by DNS-SD (RFC 6763): service _tendon._udp, with one instance per device.
/// The server announces them (server/machine/announcer.h) and clients look them up (clients/cpp/discovery).
///
/// Any host can announce any name. Only the client's key authenticates a server (SESSION.md).
/// Thread-safe. Realtime-safe: no (heap).
namespace tendon::dns_sd {

inline constexpr const char* kService = "_tendon._udp";
inline constexpr const char* kLocal = "local";
inline constexpr std::size_t kMaxName = 63;  ///< of an instance name, which is a DNS label

/// Returns true if `name` has 1 to 63 bytes of UTF-8 and contains no control characters (RFC 6763, 4.1.1).
bool is_instance_name(std::string_view name) noexcept;

/// Returns true if `name` consists of labels of 1 to 63 letters, digits, - and _, separated by dots.
bool is_domain(std::string_view name) noexcept;

/// Returns a name like "falcon at bench 3 #2" with at most 63 bytes, if `name` is in use. `attempt` starts at 2.
std::string another_name(const std::string& name, int attempt);

/// For example "falcon at bench 3" in the domain "local", which is resolved by multicast DNS instead of name servers.
struct Instance {
  std::string name;  ///< empty: all instances of the domain
  std::string domain = kLocal;
  bool operator==(const Instance&) const = default;
};

/// Parses "NAME" or "NAME.DOMAIN", or "" or ".DOMAIN" for all instances of a domain. The name extends to the first dot.
/// It can contain "\." for a dot, "\\" for a backslash, and "\DDD" for any byte in decimal, as in zone files. Throws
/// std::invalid_argument: `expected NAME or NAME.DOMAIN like "falcon at bench 3", got "…": …`.
Instance parse_instance(std::string_view text);

/// The inverse of parse_instance(), without the domain "local".
std::string to_string(const Instance& instance);

/// Returns "falcon at bench 3._tendon._udp.example.org", or "_tendon._udp.example.org" without a name.
std::string full_name(const Instance& instance);

/// The TXT record of a device. It must not contain keys or personal names.
struct About {
  std::uint32_t version = 0;            ///< "v", the wire version; 0: unknown
  std::string device;                   ///< used in claims; empty: unknown
  std::uint32_t hz = 0;                 ///< haptic steps per second; 0: unknown
  std::uint32_t suite = 0;              ///< 1: a key is required
  std::vector<std::string> channels{};  ///< at most limits::kMaxChannels
  bool operator==(const About&) const = default;
};

/// Returns the strings "v=1", "device=falcon", "hz=1000", "suite=1", "channels=main,tissue".
std::vector<std::string> to_txt(const About& about);

/// Parses strings from an untrusted source. Ignores entries that do not have the format of to_txt(), and all but the
/// first entry of a key. Keys are not case-sensitive (RFC 6763, 6.4).
About read_txt(std::span<const std::string> strings);

/// Splits a TXT record into its length-prefixed strings. Stops at a truncated string.
std::vector<std::string> split_txt(std::span<const std::byte> data);

}  // namespace tendon::dns_sd
