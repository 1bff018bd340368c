// SPDX-License-Identifier: Apache-2.0
#include "tests/clients/cpp/discovery/fake_dns.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>
#include <vector>

namespace tendon::testing {
namespace dns {

std::string two(unsigned value) { return {static_cast<char>(value >> 8U), static_cast<char>(value & 255U)}; }

std::string name(std::string_view labels) {
  std::string bytes;
  while (!labels.empty()) {
    const std::size_t end = std::min(labels.find('/'), labels.size());
    bytes += static_cast<char>(end);
    bytes += labels.substr(0, end);
    labels.remove_prefix(std::min(end + 1, labels.size()));
  }
  return bytes + '\0';
}

std::string record(std::uint16_t type, const std::string& data) {
  return "\xC0\x0C" + two(type) + two(1) + two(0) + two(60) + two(static_cast<unsigned>(data.size())) + data;
}

std::string srv(unsigned priority, unsigned weight, unsigned port, const std::string& target) {
  return record(kSrv, two(priority) + two(weight) + two(port) + target);
}

std::string answer(const Question& question, const std::vector<std::string>& records, unsigned flags) {
  std::string bytes =
      question.id + two(flags) + two(1) + two(static_cast<unsigned>(records.size())) + two(0) + two(0) + question.bytes;
  for (const std::string& one : records) bytes += one;
  return bytes;
}

namespace {

Question question_in(const std::string& datagram) {
  constexpr std::size_t kHeader = 12;
  std::size_t end = kHeader;
  while (end < datagram.size() && datagram[end] != '\0') end += static_cast<unsigned char>(datagram[end]) + 1U;
  end += 5;
  if (end > datagram.size()) throw std::runtime_error("the resolver sent no question");
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(datagram[i]); };
  return {datagram.substr(0, 2), datagram.substr(kHeader, end - kHeader),
          static_cast<std::uint16_t>(at(end - 4) << 8U | at(end - 3))};
}

}  // namespace
}  // namespace dns

FakeDns::FakeDns(Answer answer)
    : answer_(std::move(answer)), udp_(::socket(AF_INET, SOCK_DGRAM, 0)), tcp_(::socket(AF_INET, SOCK_STREAM, 0)) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  auto* const any = reinterpret_cast<sockaddr*>(&at);
  if (::bind(udp_, any, size) != 0 || ::getsockname(udp_, any, &size) != 0 || ::bind(tcp_, any, size) != 0 ||
      ::listen(tcp_, 4) != 0) {
    throw std::runtime_error("no port for a name server");
  }
  address_ = parse_address("127.0.0.1:" + std::to_string(ntohs(at.sin_port)));
  thread_ = std::thread([this] { run(); });
}

FakeDns::~FakeDns() {
  stop_ = true;
  thread_.join();
  ::close(udp_);
  ::close(tcp_);
}

void FakeDns::run() {
  while (!stop_) {
    std::array<pollfd, 2> ready{pollfd{udp_, POLLIN, 0}, pollfd{tcp_, POLLIN, 0}};
    ::poll(ready.data(), ready.size(), 20);
    std::string bytes(4096, '\0');
    if (ready[0].revents != 0) {
      sockaddr_in from{};
      socklen_t size = sizeof from;
      auto* const peer = reinterpret_cast<sockaddr*>(&from);
      bytes.resize(static_cast<std::size_t>(::recvfrom(udp_, bytes.data(), bytes.size(), 0, peer, &size)));
      ++asked_;
      const std::string said = answer_(dns::question_in(bytes), false);
      if (!said.empty()) ::sendto(udp_, said.data(), said.size(), 0, peer, size);
    }
    if (ready[1].revents != 0) {
      const int peer = ::accept(tcp_, nullptr, nullptr);
      bytes.resize(static_cast<std::size_t>(std::max<ssize_t>(::recv(peer, bytes.data(), bytes.size(), 0), 2)));
      ++asked_;
      // TCP puts two bytes of length before the message. A question fits into one segment.
      if (bytes.size() == 2) bytes.resize(2 + static_cast<std::size_t>(::recv(peer, bytes.data() + 2, 4000, 0)));
      const std::string said = answer_(dns::question_in(bytes.substr(2)), true);
      const std::string framed = dns::two(static_cast<unsigned>(said.size())) + said;
      ::send(peer, framed.data(), framed.size(), MSG_NOSIGNAL);
      ::close(peer);
    }
  }
}

}  // namespace tendon::testing
