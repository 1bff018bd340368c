// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "core/base/time.h"
#include "protocol/link.h"
#include "tests/tools/bench/other_process.h"

namespace tendon::bench {

/// `tendond`, the one beside this program, as a process of its own. It is gone when this object is.
class ServerProcess {
 public:
  /// Runs the scene file; what the server says goes into files beside it. `priority`: SCHED_FIFO of all its threads but
  /// the haptic ones; 0: as it is. Throws std::runtime_error when it does not listen within 20 s.
  ServerProcess(const std::filesystem::path& scene, int priority);
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  const Address& address() const { return address_; }
  Duration started() const { return started_; }  ///< from exec to listening
  std::uint64_t resident() const;                ///< bytes
  void check() const { process_->check(); }      ///< throws when it has ended by itself

  struct Spent {
    Duration haptic{};
    Duration network{};
    Duration rest{};
  };
  Spent spent() const;  ///< processor time so far, by threads

  /// Stops it, and returns its last line.
  std::string stop();

 private:
  std::string output() const;

  std::filesystem::path folder_;
  std::unique_ptr<OtherProcess> process_;
  Address address_;
  Duration started_{};
};

}  // namespace tendon::bench
