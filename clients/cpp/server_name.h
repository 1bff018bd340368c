// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "protocol/link.h"

namespace tendon {

/// Where a server is, as a person writes it: "haptics.lab:47100", "127.0.0.1:47100", "[::1]:47100" or
/// "localhost:47100", which is 127.0.0.1.
class ServerName {
 public:
  /// Looks nothing up. Throws std::invalid_argument when `text` is not HOST:PORT:
  /// `expected HOST:PORT like 127.0.0.1:47100, got "…"`.
  ServerName(std::string text);                                    // NOLINT(google-explicit-constructor)
  ServerName(const char* text) : ServerName(std::string(text)) {}  // NOLINT(google-explicit-constructor)
  ServerName(const Address& address);                              // NOLINT(google-explicit-constructor)

  const std::string& text() const noexcept { return text_; }

  /// The addresses of this name, the one to prefer first. A numeric address is its own, at once. A host name is looked
  /// up by the system (/etc/hosts, DNS, …), which waits, up to some seconds where no name server answers. Throws
  /// std::runtime_error when there is none: "cannot find haptics.lab: Name or service not known".
  std::vector<Address> look_up() const;

  /// This name, with the address in use where that is not the same: "haptics.lab:47100 (192.0.2.7:47100)".
  std::string at(const Address& address) const;

 private:
  std::string text_;
};

}  // namespace tendon
