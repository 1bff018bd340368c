// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "server/commands/doctor.h"
#include "server/machine/network_card.h"

namespace tendon {

/// The machine, seen from its network: what delays a datagram before the server can read it, and what interrupts the
/// haptic thread. The network cards are those in sys/class/net below `root` that are connected.
struct NetworkQuestions {
  /// The processor of the haptic thread. If empty, it is one of the isolated processors.
  std::optional<std::uint32_t> cpu{};
  /// Asks the driver of an interface. If empty, its settings are unknown.
  std::function<NetworkCard(const std::string& interface)> card{};
};

/// The findings nic_coalescing, nic_interrupts, irqbalance, clock_source, wifi_power_save and eee. Each advice is a
/// command or a setting. If a file is missing, the result is "unknown".
std::vector<Diagnosis::Finding> look_at_network(const std::filesystem::path& root, const NetworkQuestions& questions);

}  // namespace tendon
