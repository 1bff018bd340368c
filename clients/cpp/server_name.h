// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/discovery.h"
#include "protocol/link.h"

namespace tendon {

/// The name of a server as a user writes it: "haptics.lab:47100", "127.0.0.1:47100", "[::1]:47100", or
/// "localhost:47100" for 127.0.0.1; "unix:/run/tendon.sock" for the Unix socket of a server on this machine
/// ([network] unix in its scene), where the file permissions control access; or a device found by DNS-SD
/// (clients/cpp/discovery):
///
///     dns-sd:falcon at bench 3              in the local network; same as tendon://falcon at bench 3
///     dns-sd:falcon at bench 3.example.org  in a domain, by its name servers
///     dns-sd:  dns-sd:.example.org          everything in the local network or the domain, for list_servers()
class ServerName {
 public:
  /// Does not resolve the name. Throws std::invalid_argument if the format of `text` is invalid.
  ServerName(std::string text);                                    // NOLINT(google-explicit-constructor)
  ServerName(const char* text) : ServerName(std::string(text)) {}  // NOLINT(google-explicit-constructor)
  ServerName(const Address& address);                              // NOLINT(google-explicit-constructor)

  const std::string& text() const noexcept { return text_; }

  const std::string& unix_path() const noexcept { return unix_path_; }  ///< at most 107 bytes; empty for other names

  const std::optional<dns_sd::Instance>& instance() const noexcept { return instance_; }  ///< empty for other names

  struct Place {
    std::vector<Address> addresses;  ///< in order of preference; at least one
    std::string device;              ///< from DNS-SD; empty: none
  };

  /// Resolves the name. A numeric address is returned immediately; a Unix socket is represented by "127.240.0.0:0". For
  /// host names and DNS-SD this blocks, up to some seconds if no name server answers. Throws std::runtime_error if the
  /// name cannot be resolved: "cannot find haptics.lab: Name or service not known". Any host can announce any DNS-SD
  /// name, and a client without a key trusts whichever server answers. DNS-SD names are therefore refused unless the
  /// caller sets `has_key` and uses that key for all sessions.
  Place look_up(bool has_key = false) const;

  /// Returns this name, followed by the address if it differs: "haptics.lab:47100 (192.0.2.7:47100)".
  std::string at(const Address& address) const;

 private:
  std::string text_;
  std::string unix_path_;
  std::optional<dns_sd::Instance> instance_;
};

}  // namespace tendon
