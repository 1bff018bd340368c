// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "clients/cpp/server_name.h"

namespace tendon {

/// Lists servers if `server` is "dns-sd:" or "dns-sd:.DOMAIN", and returns the exit code: 0, also if none is found
/// (with a message on stderr); 1 if the query failed. Returns nullopt for the name of a single server.
///
/// Prints one line for each device to stdout, first the name for --server, "dns-sd:falcon at bench 3", then its
/// description. With `json`: {"server":"dns-sd:falcon at bench 3","device":"falcon","hz":1000,"suite":1,
/// "channels":["main"],"version":1,"host":"bench3.local","port":47100}. The results are not authenticated.
std::optional<int> list_servers(const ServerName& server, bool json);

}  // namespace tendon
