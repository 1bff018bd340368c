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

/// Runs the `tendond` next to this program in a child process, which ends with this object.
class ServerProcess {
 public:
  /// The output is written to files in the folder of the scene. `priority` is the SCHED_FIFO priority of all threads
  /// except for the haptic ones; 0: default scheduling. Throws std::runtime_error if the server does not listen within
  /// 20 s.
  ServerProcess(const std::filesystem::path& scene, int priority);
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  const Address& address() const { return address_; }
  Duration started() const { return started_; }  ///< from exec to listening
  std::uint64_t resident() const;                ///< bytes
  void check() const { process_->check(); }      ///< throws if the server has exited

  struct Spent {
    Duration haptic{};
    Duration network{};
    Duration rest{};
  };
  Spent spent() const;  ///< processor time so far, by thread

  std::string stop();

 private:
  std::string output() const;

  std::filesystem::path folder_;
  std::unique_ptr<OtherProcess> process_;
  Address address_;
  Duration started_{};
};

}  // namespace tendon::bench
