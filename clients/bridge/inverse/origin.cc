// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/inverse/origin.h"

#include <algorithm>
#include <stdexcept>

#include "protocol/link.h"

namespace tendon::bridge {

bool may_come_from(std::string_view origin, std::span<const std::string> allowed) {
  if (std::ranges::find(allowed, origin) != allowed.end()) return true;
  const std::size_t scheme = origin.starts_with("http://") ? 7 : origin.starts_with("https://") ? 8 : origin.npos;
  if (scheme == origin.npos) return false;
  const std::string_view host = origin.substr(scheme);
  const std::size_t port = host.starts_with('[') ? host.find(']') + 1 : std::min(host.find(':'), host.size());
  const std::string_view name = host.substr(0, port);
  const std::string_view rest = host.substr(name.size());
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  const bool is_port = rest.empty() || (rest.front() == ':' && std::ranges::all_of(rest.substr(1), is_digit));
  if (name.empty() || !is_port) return false;
  if (name == "localhost" || name.ends_with(".localhost")) return name.find_first_of("/?#@\\ ") == name.npos;
  try {
    return is_loopback(parse_address(std::string(name) + ":0"));
  } catch (const std::invalid_argument&) {
    return false;
  }
}

}  // namespace tendon::bridge
