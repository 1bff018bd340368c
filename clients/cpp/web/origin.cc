// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/web/origin.h"

#include <algorithm>
#include <stdexcept>

#include "protocol/link.h"

namespace tendon::web {

bool equal_but_for_case(std::string_view a, std::string_view b) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  return std::ranges::equal(a, b, {}, lower, lower);
}

std::string_view host_name(std::string_view host) {
  const auto end = host.starts_with('[') ? host.find(']') + 1 : std::min(host.find(':'), host.size());
  if (host.starts_with('[') && end == 0) return {};
  const std::string_view port = host.substr(end);
  const bool digits = port.size() > 1 && port.size() <= 6 &&
                      std::ranges::all_of(port.substr(1), [](char c) { return c >= '0' && c <= '9'; });
  return port.empty() || (port[0] == ':' && digits) ? host.substr(0, end) : std::string_view();
}

bool is_loopback_name(std::string_view name) {
  constexpr std::string_view kLocal = "localhost";
  constexpr std::string_view kBelow = ".localhost";
  if (equal_but_for_case(name, kLocal)) return true;
  if (name.size() > kBelow.size() && equal_but_for_case(name.substr(name.size() - kBelow.size()), kBelow)) return true;
  try {
    return is_loopback(parse_address(std::string(name) + ":0"));
  } catch (const std::invalid_argument&) {
    return false;
  }
}

std::string_view origin_host(std::string_view origin) {
  for (const std::string_view scheme : {"http://", "https://"}) {
    if (!origin.starts_with(scheme)) continue;
    const std::string_view host = origin.substr(scheme.size());
    return host.find_first_of("/?#@\\ ") == std::string_view::npos ? host : std::string_view();
  }
  return {};
}

bool may_come_from(std::string_view origin, std::span<const std::string> allowed) {
  return std::ranges::find(allowed, origin) != allowed.end() || is_loopback_name(host_name(origin_host(origin)));
}

}  // namespace tendon::web
