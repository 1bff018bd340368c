// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "clients/cpp/server_name.h"

namespace tendon {

/// For a program that has read its command line: when `server` is "dns-sd:" or "dns-sd:.DOMAIN", prints what is found
/// there on stdout and returns the exit code to leave with: 0, also when nothing is found, which stderr is told; 1 when
/// nothing could be asked. Empty for the name of one server: go on.
///
/// A line for each device, the name as --server takes it, "dns-sd:falcon at bench 3", then what is said of it; with
/// `json`, {"server":"dns-sd:falcon at bench 3","device":"falcon","hz":1000,"suite":1,"channels":["main"],"version":1,
/// "host":"bench3.local","port":47100}. Nobody vouches for any of it.
std::optional<int> list_servers(const ServerName& server, bool json);

}  // namespace tendon
