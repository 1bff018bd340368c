// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/toy/worker.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tendon::conformance {

using worker::Record;

void ToyWorker::put(const Record& record) {
  Bytes bytes = worker::to_bytes(record);
  if (is(WorkerFault::kCountsItself)) bytes[0] = static_cast<std::byte>(std::to_integer<unsigned>(bytes[0]) + 4);
  if (is(WorkerFault::kNoLength)) bytes.erase(bytes.begin(), bytes.begin() + 4);
  out_ = std::move(out_) + bytes;
}

void ToyWorker::start(Road road, const std::string& secret) {
  reader_ = {};
  out_.clear();
  answers_ = 0;
  running_ = !is(WorkerFault::kEndsAtOnce) && (!is(WorkerFault::kKnowsNoTcp) || road == Road::kUnix);
  if (!running_ || is(WorkerFault::kNeverOpens)) return;
  Record opening = worker::opening(is(WorkerFault::kWrongSecret) ? std::string(worker::kSecretDigits, '0') : secret);
  if (is(WorkerFault::kOpensWithASequence)) opening.sequence = 1;
  out_ = worker::to_bytes(opening);
  if (is(WorkerFault::kTalksUnasked)) put({.sequence = 1});
}

std::optional<WorkerWire::Heard> ToyWorker::receive(LocalTime deadline) {
  if (!out_.empty()) return Heard{.bytes = std::exchange(out_, {})};
  if (!running_) return Heard{.ended = "the stream has ended"};
  now_ = std::max(now_, deadline);
  return std::nullopt;
}

void ToyWorker::send(Span bytes) {
  if (!running_) return;
  reader_.add(bytes);
  auto record = reader_.next();
  if (!record && is(WorkerFault::kOneReadIsARecord)) running_ = false;
  if (record) answer(*record);
}

void ToyWorker::answer(const Record& record) {
  pb::Datagram asked;
  read(record.body, asked);
  const pb::DeviceState& hand = asked.frames(0).state();
  if (is(WorkerFault::kNeverAnswers)) return;
  if (is(WorkerFault::kDiesOfAState) || (is(WorkerFault::kDiesOfATurn) && hand.has_orientation()) ||
      (is(WorkerFault::kByteOfButtons) && hand.buttons() > 0xFF) ||
      (is(WorkerFault::kDiesOfTheUnknown) && !hand.GetReflection()->GetUnknownFields(hand).empty()) ||
      (is(WorkerFault::kTiresOfStates) && answers_ == 50)) {
    running_ = false;
    return;
  }
  ++answers_;
  pb::Datagram body;
  pb::ForceCommand& force = *body.add_frames()->mutable_force();
  force.set_sequence(is(WorkerFault::kForcesOfOneSequence) ? 1 : record.sequence);
  force.set_based_on_tick(is(WorkerFault::kTickIsADouble) ? static_cast<std::uint64_t>(static_cast<double>(hand.tick()))
                                                          : hand.tick());
  force.mutable_force_n()->set_x(-500 * hand.position_m().x());
  force.set_valid_for_us(is(WorkerFault::kNoValidity) ? 0 : 1000);
  if (is(WorkerFault::kNotFinite)) force.mutable_force_n()->set_y(std::numeric_limits<double>::quiet_NaN());
  if (is(WorkerFault::kFarTooLarge)) force.mutable_force_n()->set_y(1e13);
  if (is(WorkerFault::kFarTorque)) force.mutable_torque_nm()->set_z(1e13);
  if (is(WorkerFault::kTwoForces)) *body.add_frames() = body.frames(0);
  if (is(WorkerFault::kSendsTheStateBack)) body = asked;
  if (is(WorkerFault::kKnowsNoForce)) body.Clear();
  Record out{.sequence = is(WorkerFault::kSequenceOfItsOwn) ? record.sequence - 1 : record.sequence,
             .body = bytes_of(body)};
  if (is(WorkerFault::kBodyHasAHeader)) out.body = write(Head{}) + out.body;
  put(out);
  if (is(WorkerFault::kAnswersTwice)) put(out);
  if (is(WorkerFault::kEndsAfterAnAnswer)) running_ = false;
}

void ToyWorker::end_stream() {
  if (!is(WorkerFault::kOutlivesItsStream)) running_ = false;
}

bool ToyWorker::ends(LocalTime deadline) {
  if (running_) now_ = std::max(now_, deadline);
  return !running_;
}

}  // namespace tendon::conformance
