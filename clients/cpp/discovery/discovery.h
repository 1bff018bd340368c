// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/discovery.h"
#include "protocol/link.h"

/// Looks for servers by DNS-SD. ServerName (server_name.h) is the door for programs.
///
/// Of the domain "local" Avahi is asked, over D-Bus; of every other one the system's name servers. Nothing that is found
/// is to be believed: anybody can announce any name.
///
/// Each call waits, for at most some seconds, and throws std::runtime_error when nothing could be asked or nobody
/// answered: what was looked for, where, and what to do. Thread-safe. Realtime-safe: no.
namespace tendon::dns_sd {

struct Found {
  Instance instance;
  About about{};
  std::string host{};  ///< as is_domain(), "bench3.local"; empty: nobody has said it
  std::uint16_t port = 0;
  std::vector<Address> addresses{};  ///< of the host, the one to prefer first; of "local" alone, and not in a list
};

/// Where `instance` is; one entry for each host that has it, the one to prefer first, at least one. Of "local" there is
/// one, at the first address that came and what came 0.2 s after it; waits at most 3 s.
std::vector<Found> resolve(const Instance& instance);

/// All instances of a domain, by name; may be empty. Of "local" waits 1 to 4 s. The first kDescribed that come have
/// their host and TXT record, where somebody answered for those: each is two more questions to everybody.
std::vector<Found> browse(const std::string& domain);
inline constexpr std::size_t kDescribed = 64;

/// What the two do for the domain "local".
std::vector<Found> resolve_by_avahi(const Instance& instance);
std::vector<Found> browse_by_avahi();

/// What the two do for other domains. `server`, an IPv4 address, is asked in place of the system's name servers.
std::vector<Found> resolve_by_dns(const Instance& instance, const std::optional<Address>& server = {});
std::vector<Found> browse_by_dns(const std::string& domain, const std::optional<Address>& server = {});

}  // namespace tendon::dns_sd
