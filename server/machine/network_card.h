// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace tendon {

/// The settings of a network card that delay datagrams. The files of sysfs do not contain them, so the driver must be
/// asked. A member is empty if the driver does not have this setting, or if the kernel refuses to answer.
struct NetworkCard {
  struct Coalescing {
    std::uint32_t rx_usecs = 0;  ///< µs from a received packet to its interrupt; some drivers have modes instead
    bool adaptive = false;       ///< the card changes rx_usecs with the traffic
  };
  std::optional<Coalescing> coalescing{};
  std::optional<bool> energy_efficient{};  ///< Energy Efficient Ethernet (IEEE 802.3az) is enabled at both ends
  std::optional<bool> power_save{};        ///< of Wi-Fi: the radio sleeps between beacons
};

/// Asks by ethtool's ioctl and by nl80211, for which no privileges are required. It changes nothing. For a name without
/// an interface, all members are empty. Thread-safe: yes. Realtime-safe: no (system calls).
NetworkCard ask_network_card(const std::string& interface);

}  // namespace tendon
