// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

/// Hosts and origins in HTTP requests of browsers. Thread-safe, realtime-safe: yes.
namespace tendon::web {

bool equal_but_for_case(std::string_view a, std::string_view b);  ///< ASCII

/// Returns "localhost" for "localhost:8080", "[::1]" for "[::1]:8080", or an empty string if the port is invalid.
std::string_view host_name(std::string_view host);

/// True for localhost and its subdomains, 127.0.0.0/8 in dotted decimal, and [::1].
bool is_loopback_name(std::string_view name);

/// Returns "localhost:8000" for "http://localhost:8000", or an empty string for other origins such as "null".
std::string_view origin_host(std::string_view origin);

/// Returns whether a page from `origin` (the HTTP header, "https://lab.example") may connect: pages of this machine
/// over http or https on any port, and exact matches in `allowed`. "null", the origin of a local file, must be allowed
/// explicitly.
bool may_come_from(std::string_view origin, std::span<const std::string> allowed);

}  // namespace tendon::web
