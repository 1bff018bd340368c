// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/discovery.h"
#include "protocol/link.h"

namespace tendon {

/// Where a server is, as a person writes it: "haptics.lab:47100", "127.0.0.1:47100", "[::1]:47100" or
/// "localhost:47100", which is 127.0.0.1; "unix:/run/tendon.sock", the file of a server on this machine ([network] unix
/// of its scene), where the file's permissions are the key; or the name of a device that DNS-SD finds
/// (clients/cpp/discovery):
///
///     dns-sd:falcon at bench 3              on the local network; tendon://falcon at bench 3 is the same
///     dns-sd:falcon at bench 3.example.org  by the name servers of that domain
///     dns-sd:  dns-sd:.example.org          all of the local network, of that domain: list_servers() prints them
class ServerName {
 public:
  /// Looks nothing up. Throws std::invalid_argument if `text` has another format.
  ServerName(std::string text);                                    // NOLINT(google-explicit-constructor)
  ServerName(const char* text) : ServerName(std::string(text)) {}  // NOLINT(google-explicit-constructor)
  ServerName(const Address& address);                              // NOLINT(google-explicit-constructor)

  const std::string& text() const noexcept { return text_; }

  /// The file of a Unix socket, of at most 107 bytes; empty for all else.
  const std::string& unix_path() const noexcept { return unix_path_; }

  /// What DNS-SD is to look for; empty for HOST:PORT.
  const std::optional<dns_sd::Instance>& instance() const noexcept { return instance_; }

  struct Place {
    std::vector<Address> addresses;  ///< the one to prefer first; at least one
    std::string device;              ///< that DNS-SD names; empty: none
  };

  /// Where this name leads. A numeric address is its own, at once; the file of a socket stands for "127.240.0.0:0". A
  /// host name is looked up by the system (/etc/hosts, DNS, …), which waits, up to some seconds where no name server
  /// answers; so does DNS-SD. Throws std::runtime_error when there is nothing: "cannot find haptics.lab: Name or
  /// service not known".
  ///
  /// Anybody can announce any name, and without a key a client believes whoever answers. So a name of DNS-SD is refused
  /// unless the caller `has_key`, and speaks with that key alone.
  Place look_up(bool has_key = false) const;

  /// This name, with the address in use where that is not the same: "haptics.lab:47100 (192.0.2.7:47100)".
  std::string at(const Address& address) const;

 private:
  std::string text_;
  std::string unix_path_;
  std::optional<dns_sd::Instance> instance_;
};

}  // namespace tendon
