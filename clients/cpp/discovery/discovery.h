// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/discovery.h"
#include "protocol/link.h"

/// Finds servers by DNS-SD; programs use ServerName (server_name.h) instead. The domain "local" is queried through
/// Avahi over D-Bus, other domains through the name servers of the system. The results are not trustworthy, because any
/// host can announce any name. Each function blocks for up to some seconds, and throws std::runtime_error if the query
/// cannot be sent or is not answered. Thread-safe. Realtime-safe: no.
namespace tendon::dns_sd {

struct Found {
  Instance instance;
  About about{};
  std::string host{};  ///< satisfies is_domain(), "bench3.local"; empty: unknown
  std::uint16_t port = 0;
  std::vector<Address> addresses{};  ///< in order of preference; empty in a list and outside of "local"
};

/// Resolves `instance`. Returns one entry for each host in order of preference, at least one. In "local", returns one
/// entry with the first address and those that arrive within 0.2 s after it; blocks for at most 3 s.
std::vector<Found> resolve(const Instance& instance);

/// Lists all instances in a domain by name; may be empty. In "local", blocks for 1 to 4 s. Only the first kDescribed
/// instances are resolved to host and TXT record, because each costs two more multicast queries.
std::vector<Found> browse(const std::string& domain);
inline constexpr std::size_t kDescribed = 64;

std::vector<Found> resolve_by_avahi(const Instance& instance);
std::vector<Found> browse_by_avahi();

/// For other domains. `server`, an IPv4 address, replaces the name servers of the system.
std::vector<Found> resolve_by_dns(const Instance& instance, const std::optional<Address>& server = {});
std::vector<Found> browse_by_dns(const std::string& domain, const std::optional<Address>& server = {});

}  // namespace tendon::dns_sd
