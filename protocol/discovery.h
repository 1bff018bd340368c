// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Names and TXT records of DNS-SD (RFC 6763), by which clients find servers: service _tendon._udp, one instance per
/// device. server/machine/announcer.h announces them; clients/cpp/discovery looks them up.
///
/// Any host can announce any name. An instance only gives an address; the client's key authenticates the server
/// (SESSION.md).
///
/// Thread-safe. Realtime-safe: no (heap).
namespace tendon::dns_sd {

inline constexpr const char* kService = "_tendon._udp";
inline constexpr const char* kLocal = "local";
/// Maximum number of bytes in the name of an instance, which is one DNS label.
inline constexpr std::size_t kMaxName = 63;

/// Returns true if `name` is a valid instance name: 1 to 63 bytes of UTF-8 without control characters (RFC 6763,
/// 4.1.1).
bool is_instance_name(std::string_view name) noexcept;

/// Returns true if `name` is a domain or host name: labels of 1 to 63 letters, digits, - and _, separated by dots.
bool is_domain(std::string_view name) noexcept;

/// Returns an alternative such as "falcon at bench 3 #2" when `name` is taken. `attempt` starts at 2. A long name is
/// cut so that the result has at most 63 bytes.
std::string another_name(const std::string& name, int attempt);

/// One instance, for example "falcon at bench 3" in the domain "local". Multicast DNS resolves "local"; name servers
/// resolve all other domains.
struct Instance {
  std::string name;  ///< see is_instance_name(); empty: all instances of the domain
  std::string domain = kLocal;
  bool operator==(const Instance&) const = default;
};

/// Parses "NAME" or "NAME.DOMAIN", or "" or ".DOMAIN" for all instances of a domain. The name ends at the first dot. As
/// in zone files, "\." is a dot in the name, "\\" a backslash and "\DDD" any byte in decimal. Throws
/// std::invalid_argument: `expected NAME or NAME.DOMAIN like "falcon at bench 3", got "…": …`.
Instance parse_instance(std::string_view text);

/// The inverse of parse_instance(). The domain "local" is left out.
std::string to_string(const Instance& instance);

/// The name in DNS queries: "falcon at bench 3._tendon._udp.example.org", or "_tendon._udp.example.org" without a name.
std::string full_name(const Instance& instance);

/// The TXT record of a device. It contains no key and no personal name.
struct About {
  std::uint32_t version = 0;            ///< "v": version of the wire; 0: unknown
  std::string device;                   ///< device name for claims; empty: unknown
  std::uint32_t hz = 0;                 ///< haptic steps per second; 0: unknown
  std::uint32_t suite = 0;              ///< 1: the server requires a key
  std::vector<std::string> channels{};  ///< at most limits::kMaxChannels
  bool operator==(const About&) const = default;
};

/// The strings of the record: "v=1", "device=falcon", "hz=1000", "suite=1", "channels=main,tissue".
std::vector<std::string> to_txt(const About& about);

/// Parses the strings of a record from an untrusted source. An entry that is not in the format of to_txt() is ignored.
/// If a key occurs more than once, the first one counts. Keys are not case-sensitive (RFC 6763, 6.4).
About read_txt(std::span<const std::string> strings);

/// Splits the data of a TXT record into its strings, each preceded by its length. Parsing stops at a truncated string.
std::vector<std::string> split_txt(std::span<const std::byte> data);

}  // namespace tendon::dns_sd
