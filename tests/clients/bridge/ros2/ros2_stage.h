// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/server/scratch_folder.h"

namespace tendon::e2e {

/// A DDS domain that is not used by any other test on this machine. It is reserved by binding a UDP port of the domain
/// that participants with an index below 100 do not use.
class Domain {
 public:
  Domain() {
    static int next = static_cast<int>(::getpid());
    for (int tries = 0; tries < 99; ++tries) {
      number_ = 1 + next++ % 99;
      socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      address.sin_port = htons(static_cast<std::uint16_t>(7400 + 250 * number_ + 249));
      if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return;
      ::close(socket_);
    }
    throw std::runtime_error("all DDS domains are in use");
  }
  ~Domain() { ::close(socket_); }
  Domain(const Domain&) = delete;
  Domain& operator=(const Domain&) = delete;
  std::string text() const { return std::to_string(number_); }

 private:
  int number_ = 0;
  int socket_ = -1;
};

inline std::vector<std::string> with(std::vector<std::string> all, const std::vector<std::string>& more) {
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

class BridgeProcess : public Process {
 public:
  BridgeProcess(const testing::ScratchFolder& folder, const std::string& server, const Domain& domain,
                const std::vector<std::string>& more = {})
      : Process(program("tendon-bridge"),
                with({"ros2", "--server", server, "--domain", domain.text(), "--json", "--duration-s", "110"}, more),
                folder.path()) {
    wait_for_line(R"("event":"listening")");
  }
};

}  // namespace tendon::e2e
