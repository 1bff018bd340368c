// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "clients/cpp/worker/stream.h"
#include "tests/tools/conformance/worker_checks.h"

namespace tendon::conformance {

enum class WorkerFault : std::uint8_t {
  kNone,
  kNeverOpens,
  kEndsAtOnce,
  kWrongSecret,
  kOpensWithASequence,
  kKnowsNoTcp,
  kCountsItself,  ///< its lengths include the length field
  kNoLength,
  kTalksUnasked,
  kAnswersTwice,
  kEndsAfterAnAnswer,
  kNeverAnswers,
  kDiesOfAState,
  kSequenceOfItsOwn,
  kBodyHasAHeader,
  kTwoForces,
  kSendsTheStateBack,
  kTickIsADouble,
  kForcesOfOneSequence,
  kNotFinite,
  kFarTooLarge,
  kFarTorque,
  kNoValidity,
  kOneReadIsARecord,
  kDiesOfATurn,
  kByteOfButtons,
  kDiesOfTheUnknown,
  kTiresOfStates,
  kOutlivesItsStream,
  kKnowsNoForce,  ///< not a fault
};

/// A minimal conforming worker (a spring) in virtual time, which can break one rule.
class ToyWorker : public WorkerWire {
 public:
  explicit ToyWorker(WorkerFault fault) : fault_(fault) {}

  LocalTime now() override { return now_; }
  void start(Road road, const std::string& secret) override;
  std::optional<Heard> receive(LocalTime deadline) override;
  void send(Span bytes) override;
  void end_stream() override;
  bool ends(LocalTime deadline) override;
  void kill() override { running_ = false; }
  std::uint64_t random() override { return state_ += 0x9E3779B97F4A7C15U; }

 private:
  bool is(WorkerFault fault) const { return fault_ == fault; }
  void answer(const worker::Record& record);
  void put(const worker::Record& record);

  WorkerFault fault_;
  LocalTime now_{std::chrono::seconds(1)};
  std::uint64_t state_ = 42;
  bool running_ = false;
  worker::RecordReader reader_;
  Bytes out_;
  int answers_ = 0;
};

}  // namespace tendon::conformance
