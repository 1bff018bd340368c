// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace tendon::bridge {

/// Returns whether a page from `origin` (the HTTP header, "https://lab.example") may connect: pages of this machine
/// over http or https on any port (localhost and its subdomains, 127.0.0.0/8, [::1]), and exact matches in `allowed`.
/// "null", the origin of a local file, must be allowed explicitly. Thread-safe, realtime-safe: yes.
bool may_come_from(std::string_view origin, std::span<const std::string> allowed);

}  // namespace tendon::bridge
