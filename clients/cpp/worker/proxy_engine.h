// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <iosfwd>
#include <optional>
#include <string>

#include "clients/cpp/run.h"
#include "clients/cpp/worker/proxy_scheduler.h"
#include "clients/cpp/worker/worker_process.h"

namespace tendon::worker {

/// An engine for run() whose answers come from a worker, a separate program that may be slow, stop or crash. The
/// session with the server stays open in all cases. Thread-safe: no. Realtime-safe: no.
class ProxyEngine : public Elsewhere {
 public:
  struct Config {
    std::string name;  ///< program name, prefix of the messages
    ProxyScheduler::Config scheduler{};
    WorkerProcess::Config process;
  };

  /// `says` receives each change of the worker, and must outlive this. Throws as ProxyScheduler and WorkerProcess do.
  ProxyEngine(const Config& config, LocalTime now, std::ostream& says);

  void see(LocalTime now, const Seen& seen) override;
  std::optional<Reply> turn(LocalTime now) override;
  LocalTime next_turn() const override { return scheduler_.next_turn(); }
  int descriptor() const override { return process_.descriptor(); }

  ProxyScheduler::Stats stats() const { return scheduler_.stats(); }

 private:
  void take(LocalTime now, const WorkerProcess::Event& event);
  std::optional<Reply> carry_out(LocalTime now, const ProxyScheduler::Order& order);
  void say(const std::string& text);

  std::string name_;
  std::ostream& says_;
  ProxyScheduler scheduler_;
  WorkerProcess process_;
  Codec codec_;
  ProxyScheduler::Ask question_{};
  std::string_view refused_{};
};

}  // namespace tendon::worker
