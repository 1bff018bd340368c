// SPDX-License-Identifier: Apache-2.0
#include "protocol/link.h"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <optional>
#include <stdexcept>

namespace tendon {
namespace {

std::optional<std::uint16_t> parse_port(std::string_view text) {
  std::uint16_t port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  if (error != std::errc{} || stop != end) return std::nullopt;
  return port;
}

std::optional<Address> parse(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const std::optional<std::uint16_t> port = parse_port(text.substr(colon + 1));
  if (!port) return std::nullopt;

  Address address;
  address.port = *port;
  std::string host(text.substr(0, colon));
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
    if (inet_pton(AF_INET6, host.c_str(), address.ip.data()) != 1) return std::nullopt;
    return address;
  }
  if (host == "localhost") host = "127.0.0.1";
  std::copy(kMappedIpv4.begin(), kMappedIpv4.end(), address.ip.begin());
  if (inet_pton(AF_INET, host.c_str(), address.ip.data() + kMappedIpv4.size()) != 1) return std::nullopt;
  return address;
}

}  // namespace

std::string to_string(const Address& address) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const std::string port = ":" + std::to_string(address.port);
  if (is_ipv4(address)) {
    inet_ntop(AF_INET, address.ip.data() + kMappedIpv4.size(), text.data(), text.size());
    return text.data() + port;
  }
  inet_ntop(AF_INET6, address.ip.data(), text.data(), text.size());
  return "[" + std::string(text.data()) + "]" + port;
}

Address parse_address(std::string_view text) {
  // inet_pton() would ignore everything after a NUL.
  const std::optional<Address> address = text.find('\0') == std::string_view::npos ? parse(text) : std::nullopt;
  if (!address) {
    throw std::invalid_argument("expected HOST:PORT like 127.0.0.1:47100 or [::1]:47100, got \"" + std::string(text) +
                                "\"");
  }
  return *address;
}

bool is_ipv4(const Address& address) noexcept {
  return std::equal(kMappedIpv4.begin(), kMappedIpv4.end(), address.ip.begin());
}

bool is_loopback(const Address& address) noexcept {
  if (is_ipv4(address)) return address.ip[kMappedIpv4.size()] == 127;
  constexpr std::array<std::uint8_t, 16> kLoopback6 = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  return address.ip == kLoopback6;
}

}  // namespace tendon
