// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "protocol/link.h"

namespace tendon::testing {

/// Builds DNS messages (RFC 1035), valid or malformed.
namespace dns {

inline constexpr std::uint16_t kPtr = 12;
inline constexpr std::uint16_t kTxt = 16;
inline constexpr std::uint16_t kSrv = 33;

std::string two(unsigned value);
/// Labels are separated by '/': "falcon at 3/_tendon/_udp/example/org".
std::string name(std::string_view labels);
/// This record is for the name in the question.
std::string record(std::uint16_t type, const std::string& data);
std::string srv(unsigned priority, unsigned weight, unsigned port, const std::string& target);

struct Question {
  std::string id;     ///< 2 bytes
  std::string bytes;  ///< name, type, class
  std::uint16_t type;
};
/// Encodes an answer with these records. `flags` is 0x8180 (no error), 0x8183 (no such name) or 0x8380 (truncated).
std::string answer(const Question& question, const std::vector<std::string>& records, unsigned flags = 0x8180);

}  // namespace dns

/// A name server on loopback with UDP and TCP on the same port. It has its own thread.
class FakeDns {
 public:
  /// Returns the answer. If it is empty, there is no answer.
  using Answer = std::function<std::string(const dns::Question&, bool tcp)>;
  explicit FakeDns(Answer answer);
  ~FakeDns();
  FakeDns(const FakeDns&) = delete;
  FakeDns& operator=(const FakeDns&) = delete;

  const Address& address() const { return address_; }
  int asked() const { return asked_; }

 private:
  void run();

  Answer answer_;
  int udp_;
  int tcp_;
  Address address_;
  std::atomic<int> asked_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace tendon::testing
