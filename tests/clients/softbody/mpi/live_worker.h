// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <poll.h>

#include <stdexcept>
#include <string>

#include "clients/cpp/worker/worker_process.h"

namespace tendon::softbody {

class LiveWorker {
 public:
  /// Throws std::runtime_error if the worker is not ready after `patience_s`.
  LiveWorker(const std::string& command, int patience_s) : process_({.command = command}), patience_s_(patience_s) {
    process_.launch(std::string(worker::kSecretDigits, '7'));
    if (!std::holds_alternative<worker::WorkerProcess::Opened>(next())) throw std::runtime_error(command + ": " + why_);
  }

  Touch answer(const DeviceState& hand) {
    ++sequence_;
    process_.send(codec_.state(sequence_, hand));
    const auto event = next();
    if (!std::holds_alternative<worker::Record>(event)) throw std::runtime_error("no answer: " + why_);
    const auto answer = codec_.read_answer(std::get<worker::Record>(event), sequence_, hand);
    if (!answer.touch) throw std::runtime_error(std::string(answer.refused));
    return *answer.touch;
  }
  Touch answer(const Vec3& position) {
    DeviceState hand;
    hand.tick = sequence_ + 1;
    hand.position = position;
    return answer(hand);
  }

 private:
  worker::WorkerProcess::Event next() {
    why_ = "nothing was heard for " + std::to_string(patience_s_) + " s";
    for (int waited = 0; waited < 10 * patience_s_;) {
      if (auto event = process_.next()) {
        if (const auto* ended = std::get_if<worker::WorkerProcess::Ended>(&*event)) why_ = ended->why;
        return *std::move(event);
      }
      pollfd readable{.fd = process_.descriptor(), .events = POLLIN, .revents = 0};
      waited += ::poll(&readable, 1, 100) == 0 ? 1 : 0;
    }
    return worker::WorkerProcess::Ended{why_};
  }

  worker::WorkerProcess process_;
  worker::Codec codec_;
  int patience_s_;
  std::uint64_t sequence_ = 0;
  std::string why_;
};

}  // namespace tendon::softbody
