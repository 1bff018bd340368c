// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/server_name.h"

#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "clients/cpp/discovery/discovery.h"

namespace tendon {
namespace {

constexpr std::size_t kMaxHost = 253;

std::optional<Address> numeric(const std::string& text) {
  try {
    return parse_address(text);
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

struct HostAndPort {
  std::string host;
  std::uint16_t port;
};

std::optional<HostAndPort> split(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon > kMaxHost) return std::nullopt;
  const std::string host = text.substr(0, colon);
  const bool is_name = std::all_of(host.begin(), host.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '.' || c == '_';
  });
  const auto port = numeric("127.0.0.1" + text.substr(colon));
  if (!is_name || host.front() == '-' || !port) return std::nullopt;
  return HostAndPort{host, port->port};
}

/// Returns nullopt unless `text` starts with "dns-sd:" or "tendon://".
std::optional<dns_sd::Instance> instance_in(std::string_view text) {
  for (const std::string_view scheme : {"dns-sd:", "tendon://"}) {
    if (text.starts_with(scheme)) return dns_sd::parse_instance(text.substr(scheme.size()));
  }
  return std::nullopt;
}

std::string unix_path_in(std::string_view text) {
  constexpr std::string_view kScheme = "unix:";
  constexpr std::size_t kMost = sizeof sockaddr_un::sun_path - 1;
  if (!text.starts_with(kScheme)) return {};
  text.remove_prefix(kScheme.size());
  if (text.empty() || text.size() > kMost || text.find('\0') != std::string_view::npos) {
    throw std::invalid_argument("expected unix:PATH with a path of 1 to " + std::to_string(kMost) +
                                " bytes, like unix:/run/tendon.sock, got \"unix:" + std::string(text) + "\"");
  }
  return std::string(text);
}

Address from_system(const addrinfo& found, std::uint16_t port) {
  Address address;
  if (found.ai_family == AF_INET) {
    sockaddr_in v4{};
    std::memcpy(&v4, found.ai_addr, sizeof v4);
    address.ip[10] = address.ip[11] = 0xFF;  // IPv4-mapped
    std::memcpy(&address.ip[12], &v4.sin_addr, 4);
  } else {
    sockaddr_in6 v6{};
    std::memcpy(&v6, found.ai_addr, sizeof v6);
    std::memcpy(address.ip.data(), &v6.sin6_addr, address.ip.size());
  }
  address.port = port;
  return address;
}

std::vector<Address> addresses_of(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(host.c_str(), nullptr, &hints, &found); error != 0) {
    throw std::runtime_error("cannot find " + host + ": " +
                             (error == EAI_SYSTEM ? std::generic_category().message(errno) : ::gai_strerror(error)));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);
  std::vector<Address> addresses;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    if (one->ai_family == AF_INET || one->ai_family == AF_INET6) addresses.push_back(from_system(*one, port));
  }
  if (addresses.empty()) throw std::runtime_error("cannot find " + host + ": it has no IP address");
  return addresses;
}

}  // namespace

ServerName::ServerName(std::string text)
    : text_(std::move(text)), unix_path_(unix_path_in(text_)), instance_(instance_in(text_)) {
  if (unix_path_.empty() && !instance_ && !split(text_)) parse_address(text_);  // throws if invalid
}

ServerName::ServerName(const Address& address) : text_(to_string(address)) {}

ServerName::Place ServerName::look_up(bool has_key) const {
  if (!unix_path_.empty()) return {{parse_address("127.240.0.0:0")}, {}};
  if (const auto address = numeric(text_)) return {{*address}, {}};
  if (!instance_) {
    const auto [host, port] = *split(text_);
    return {addresses_of(host, port), {}};
  }
  if (instance_->name.empty())
    throw std::runtime_error(text_ + " is a list, which is printed by echo_motion --server " + text_ +
                             " prints: expected a name in it");
  if (!has_key) {
    throw std::runtime_error(
        text_ + ": anyone can announce this name, and only a key proves the identity of the server: expected " +
        "a key (--key FILE), or HOST:PORT instead of the name");
  }
  Place place;
  for (const dns_sd::Found& found : dns_sd::resolve(*instance_)) {
    if (place.addresses.empty()) place.device = found.about.device;
    const auto more = found.addresses.empty() ? addresses_of(found.host, found.port) : found.addresses;
    place.addresses.insert(place.addresses.end(), more.begin(), more.end());
  }
  return place;
}

std::string ServerName::at(const Address& address) const {
  if (!unix_path_.empty()) return text_;
  const auto own = numeric(text_);
  return own && *own == address ? text_ : text_ + " (" + to_string(address) + ")";
}

}  // namespace tendon
