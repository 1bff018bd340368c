// SPDX-License-Identifier: Apache-2.0
#include "server/machine/network_card.h"

#include <linux/ethtool.h>
#include <linux/genetlink.h>
#include <linux/netlink.h>
#include <linux/nl80211.h>
#include <linux/sockios.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <span>
#include <system_error>
#include <vector>

namespace tendon {
namespace {

class Socket {
 public:
  Socket(int family, int type, int protocol) : fd_(::socket(family, type | SOCK_CLOEXEC, protocol)) {}
  ~Socket() {
    if (fd_ >= 0) ::close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const noexcept { return fd_; }

 private:
  int fd_;
};

/// `Answer` is a struct of linux/ethtool.h, which begins with the command.
template <class Answer>
std::optional<Answer> ask_ethtool(const Socket& socket, const std::string& interface, std::uint32_t command) {
  Answer answer{};
  answer.cmd = command;
  ifreq request{};
  std::copy(interface.begin(), interface.end(), std::begin(request.ifr_name));
  request.ifr_data = reinterpret_cast<char*>(&answer);
  if (::ioctl(socket.fd(), SIOCETHTOOL, &request) != 0) return std::nullopt;
  return answer;
}

/// Generic netlink with one attribute in the question. See linux/genetlink.h.
class GenericNetlink {
 public:
  /// Returns the attribute `wanted` of the answer, or an empty vector.
  std::vector<std::byte> ask(std::uint16_t family, std::uint8_t command, std::uint16_t attribute,
                             std::span<const std::byte> value, std::uint16_t wanted) {
    struct Header {
      nlmsghdr message;
      genlmsghdr command;
      nlattr attribute;
    } header{};
    const std::size_t size = sizeof header + NLA_ALIGN(value.size());
    header.message = {.nlmsg_len = static_cast<std::uint32_t>(size),
                      .nlmsg_type = family,
                      .nlmsg_flags = NLM_F_REQUEST,
                      .nlmsg_seq = 1,
                      .nlmsg_pid = 0};
    header.command = {.cmd = command, .version = 1, .reserved = 0};
    header.attribute = {.nla_len = static_cast<std::uint16_t>(NLA_HDRLEN + value.size()), .nla_type = attribute};
    std::vector<std::byte> question(size);
    std::memcpy(question.data(), &header, sizeof header);
    std::copy(value.begin(), value.end(), question.begin() + sizeof header);
    if (::send(socket_.fd(), question.data(), question.size(), 0) < 0) return {};
    // The kernel has answered when send() returns.
    const ssize_t received = ::recv(socket_.fd(), buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    if (received < 0) return {};
    return attribute_of(std::span(buffer_).first(static_cast<std::size_t>(received)), family, wanted);
  }

 private:
  static std::vector<std::byte> attribute_of(std::span<const std::byte> answer, std::uint16_t family,
                                             std::uint16_t wanted) {
    nlmsghdr header;
    if (answer.size() < NLMSG_HDRLEN + GENL_HDRLEN) return {};
    std::memcpy(&header, answer.data(), sizeof header);
    if (header.nlmsg_type != family) return {};  // NLMSG_ERROR
    answer = answer.first(std::min<std::size_t>(answer.size(), header.nlmsg_len)).subspan(NLMSG_HDRLEN + GENL_HDRLEN);
    while (answer.size() >= NLA_HDRLEN) {
      nlattr attribute;
      std::memcpy(&attribute, answer.data(), sizeof attribute);
      if (attribute.nla_len < NLA_HDRLEN || attribute.nla_len > answer.size()) return {};
      const auto value = answer.subspan(NLA_HDRLEN, attribute.nla_len - NLA_HDRLEN);
      if ((attribute.nla_type & NLA_TYPE_MASK) == wanted) return {value.begin(), value.end()};
      answer = answer.subspan(std::min<std::size_t>(answer.size(), NLA_ALIGN(attribute.nla_len)));
    }
    return {};
  }

  Socket socket_{AF_NETLINK, SOCK_RAW, NETLINK_GENERIC};
  std::array<std::byte, 32768> buffer_{};  // the description of nl80211 has 3 kB
};

template <class Number>
std::optional<Number> number_in(const std::vector<std::byte>& value) {
  Number number;
  if (value.size() != sizeof number) return std::nullopt;
  std::memcpy(&number, value.data(), sizeof number);
  return number;
}

std::optional<bool> ask_power_save(std::uint32_t index) {
  GenericNetlink netlink;
  const auto family =
      number_in<std::uint16_t>(netlink.ask(GENL_ID_CTRL, CTRL_CMD_GETFAMILY, CTRL_ATTR_FAMILY_NAME,
                                           std::as_bytes(std::span(NL80211_GENL_NAME)), CTRL_ATTR_FAMILY_ID));
  if (!family) return std::nullopt;
  const auto state = number_in<std::uint32_t>(netlink.ask(*family, NL80211_CMD_GET_POWER_SAVE, NL80211_ATTR_IFINDEX,
                                                          std::as_bytes(std::span(&index, 1)), NL80211_ATTR_PS_STATE));
  if (!state) return std::nullopt;
  return *state == NL80211_PS_ENABLED;
}

}  // namespace

NetworkCard ask_network_card(const std::string& interface) {
  NetworkCard card;
  const std::uint32_t index = interface.size() < IFNAMSIZ ? ::if_nametoindex(interface.c_str()) : 0;
  if (index == 0) return card;
  const Socket socket(AF_INET, SOCK_DGRAM, 0);
  if (const auto said = ask_ethtool<ethtool_coalesce>(socket, interface, ETHTOOL_GCOALESCE)) {
    card.coalescing = {.rx_usecs = said->rx_coalesce_usecs, .adaptive = said->use_adaptive_rx_coalesce != 0};
  }
  if (const auto said = ask_ethtool<ethtool_eee>(socket, interface, ETHTOOL_GEEE)) {
    card.energy_efficient = said->eee_enabled != 0 && said->eee_active != 0;
  }
  // If a machine has no Wi-Fi, this question would load its kernel module.
  std::error_code none;
  if (std::filesystem::exists("/sys/class/net/" + interface + "/phy80211", none)) {
    card.power_save = ask_power_save(index);
  }
  return card;
}

}  // namespace tendon
