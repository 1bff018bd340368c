// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/worker_checks.h"

#include <array>
#include <cmath>
#include <exception>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/cpp/worker/stream.h"
#include "protocol/limits.h"

namespace tendon::conformance {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using worker::Record;
using Road = WorkerWire::Road;

/// Time until the opening record. MPI and an interpreter are slow on a busy machine; a proxy waits as long.
constexpr Duration kStart = std::chrono::minutes(2);
/// The first answer may require a compilation or a factorization.
constexpr Duration kAnswer = seconds(30);
constexpr Duration kEnd = seconds(10);
constexpr Duration kQuiet = milliseconds(300);
constexpr Duration kPause = milliseconds(20);
constexpr int kFirstStates = 3;
constexpr int kInARow = 100;
/// A double cannot represent odd integers from here on.
constexpr std::uint64_t kFirstTick = (std::uint64_t{1} << 53U) + 1;

const char* name_of(Road road) { return road == Road::kUnix ? "over a Unix socket: " : "over TCP: "; }

void set(pb::Vec3& vector, double x, double y, double z) {
  vector.set_x(x);
  vector.set_y(y);
  vector.set_z(z);
}

/// Sets all optional fields: 16 pressed buttons and 8 joints.
void add_handle(pb::DeviceState& state) {
  state.set_reasons(0xFFFF);
  state.set_permitted_force_n(HUGE_VAL);
  state.set_force_sequence(std::uint64_t{1} << 40U);
  state.set_force_age_ns(12'000'000);
  state.set_device(limits::kMaxDevices - 1);
  state.set_channel(limits::kMaxChannels - 1);
  set(*state.mutable_force_wanted_n(), 1, -2, 3);
  for (const double entry : {500, 10, 0, 10, 400, 0, 0, 0, 300}) state.add_stiffness_wanted_npm(entry);
  pb::Quat& turn = *state.mutable_orientation();
  turn.set_w(0.5);
  turn.set_x(-0.5);
  turn.set_y(0.5);
  turn.set_z(-0.5);
  set(*state.mutable_angular_velocity_radps(), 0.1, 0, -0.1);
  state.set_buttons(0xFFFF);
  set(*state.mutable_torque_applied_nm(), 0.01, 0.02, -0.03);
  state.set_gripper_rad(0.4);
  state.set_gripper_velocity_radps(-0.1);
  state.set_gripper_force_applied_n(1.5);
  set(*state.mutable_hand_force_n(), 0.3, -0.4, 0.5);
  for (int i = 0; i < 8; ++i) {
    state.add_joint_rad(0.1 * i);
    state.add_joint_velocity_radps(-0.01 * i);
  }
}

class WorkerJudge {
 public:
  WorkerJudge(WorkerWire& wire, Report& report, Road road) : wire_(wire), report_(report), road_(road) {}

  void judge() {
    converse();
    wire_.kill();
  }
  bool answered() const noexcept { return answered_; }
  bool heard_force() const noexcept { return heard_force_; }

 private:
  void converse();
  bool open();
  pb::DeviceState next_state();
  bool ask(const pb::DeviceState& state, std::string_view check, std::span<const std::size_t> cuts = {});
  void judge_answer(const Record& record, const pb::DeviceState& state);
  bool silent(LocalTime deadline);
  /// Returns the next record, or nullopt at the deadline or the end of the stream, which sets `over_`.
  std::optional<Record> next(LocalTime deadline);
  void judge(std::string_view check, bool kept, std::string_view seen, std::string_view expected) {
    report_.judge(check, kept, name_of(road_) + std::string(seen), std::string(expected));
  }

  WorkerWire& wire_;
  Report& report_;
  Road road_;
  worker::RecordReader reader_;
  worker::Codec codec_;
  std::string over_;
  std::uint64_t sequence_ = 0;
  bool answered_ = false;
  bool heard_force_ = false;
};

std::optional<Record> WorkerJudge::next(LocalTime deadline) {
  for (;;) {
    try {
      if (auto record = reader_.next()) {
        judge("record-length", true, "", "");
        return record;
      }
    } catch (const std::runtime_error& error) {
      judge("record-length", false, error.what(), "a length of 8 to 1208 in front of each record");
      over_ = "the stream has no records";
      reader_ = {};
    }
    if (!over_.empty()) return std::nullopt;
    const auto heard = wire_.receive(deadline);
    if (!heard) return std::nullopt;
    over_ = heard->ended;
    reader_.add(heard->bytes);
  }
}

bool WorkerJudge::open() {
  std::string secret;
  while (secret.size() < worker::kSecretDigits) {
    for (std::uint64_t number = wire_.random(), i = 0; i < 16; ++i, number >>= 4U)
      secret += "0123456789abcdef"[number & 15U];
  }
  wire_.start(road_, secret);
  const auto record = next(wire_.now() + kStart);
  if (!record && report_.failed("record-length")) return false;
  const bool opened = record && worker::opens(*record, secret);
  const std::string seen = record ? "sequence " + std::to_string(record->sequence) + ", " + hex(record->body, 24)
                           : over_.empty() ? "nothing within two minutes after its start"
                                           : over_;
  judge("stream-opens", opened, seen,
        std::string("sequence 0, \"tendon worker 1\", a newline, and the secret of ") + worker::kSecretVariable);
  return opened;
}

bool WorkerJudge::silent(LocalTime deadline) {
  const auto record = next(deadline);
  const bool waits = !record && over_.empty();
  judge("stream-silent", waits, record ? "a record of sequence " + std::to_string(record->sequence) : over_,
        "nothing as long as there is no state to answer");
  return waits;
}

pb::DeviceState WorkerJudge::next_state() {
  const double phase = 0.1 * static_cast<double>(sequence_);
  pb::DeviceState state;
  state.set_tick(kFirstTick + 10 * sequence_);
  state.set_sampled_ns(static_cast<std::int64_t>(sequence_ * 10'000'000));
  set(*state.mutable_position_m(), 0.005 * std::cos(phase), 0.005 * std::sin(phase), -0.003);
  set(*state.mutable_velocity_mps(), -0.05 * std::sin(phase), 0.05 * std::cos(phase), 0);
  set(*state.mutable_force_applied_n(), 0, 0, 0.5);
  state.set_energy_j(0.01);
  state.set_permitted_force_n(8);
  state.set_mode(pb::MODE_ACTIVE);
  return state;
}

/// Sends a state in fragments that end at `cuts`, and judges its answer. Returns false without one; `check` has failed.
bool WorkerJudge::ask(const pb::DeviceState& state, std::string_view check, std::span<const std::size_t> cuts) {
  if (!silent(wire_.now())) return false;
  pb::Datagram body;
  *body.add_frames()->mutable_state() = state;
  const Bytes bytes = worker::to_bytes({.sequence = ++sequence_, .body = bytes_of(body)});
  std::size_t sent = 0;
  for (const std::size_t cut : cuts) {
    wire_.send(Span(bytes).subspan(sent, cut - sent));
    sent = cut;
    if (next(wire_.now() + kPause) || !over_.empty()) {
      judge(check, false, over_.empty() ? "an answer before the last piece" : over_, "an answer after the last piece");
      return false;
    }
  }
  wire_.send(Span(bytes).subspan(sent));
  const auto answer = next(wire_.now() + kAnswer);
  if (answer) {
    answered_ = true;
    judge(check, true, "", "");
    judge("answer-sequence", answer->sequence == sequence_, std::to_string(answer->sequence),
          std::to_string(sequence_));
    if (answer->sequence != sequence_) return false;
    judge_answer(*answer, state);
    return true;
  }
  if (report_.failed("record-length")) return false;
  judge(check, false, over_.empty() ? "nothing within 30 s" : over_,
        "an answer to sequence " + std::to_string(sequence_));
  return false;
}

void WorkerJudge::judge_answer(const Record& record, const pb::DeviceState& state) {
  pb::Datagram body;
  const bool is_datagram = read(record.body, body);
  const bool is_force = is_datagram && body.frames_size() == 1 && body.frames(0).has_force();
  judge("answer-body", is_datagram && (is_force || body.frames_size() == 0), hex(record.body),
        "a Datagram without a header, with one force or with no frame");
  if (!is_force) return;
  heard_force_ = true;
  const pb::ForceCommand& force = body.frames(0).force();
  const bool names = force.based_on_tick() == state.tick() && force.sequence() == record.sequence;
  judge("answer-names-state", names,
        "based_on_tick " + std::to_string(force.based_on_tick()) + ", sequence " + std::to_string(force.sequence()),
        "based_on_tick " + std::to_string(state.tick()) + ", sequence " + std::to_string(record.sequence));
  if (!names) return;
  DeviceState hand;
  hand.tick = state.tick();
  const auto taken = codec_.read_answer(record, record.sequence, hand);
  judge("answer-bounds", taken.touch.has_value(), taken.refused,
        "every number finite and within its bounds of WIRE.md");
}

void WorkerJudge::converse() {
  if (!open() || !silent(wire_.now() + kQuiet)) return;
  for (int i = 0; i < kFirstStates; ++i) {
    if (!ask(next_state(), "answer-comes")) return;
  }
  pb::DeviceState state = next_state();
  const std::size_t size = 12 + state.ByteSizeLong();
  const std::array<std::size_t, 5> cuts = {2, 4, 9, 30, size};
  if (!ask(state, "state-in-pieces", cuts)) return;
  state = next_state();
  add_handle(state);
  if (!ask(state, "state-of-a-handle")) return;
  state = next_state();
  state.GetReflection()->MutableUnknownFields(&state)->AddLengthDelimited(500, "of version 2");
  if (!ask(state, "state-unknown-field")) return;
  for (int i = 0; i < kInARow; ++i) {
    if (!ask(next_state(), "states-in-a-row")) return;
  }
  if (!silent(wire_.now() + kQuiet)) return;
  wire_.end_stream();
  judge("stream-ends", wire_.ends(wire_.now() + kEnd), "the program runs 10 s after the end of its stream",
        "the end of the program");
}

}  // namespace

void judge_worker(WorkerWire& wire, Report& report) {
  bool answered = false;
  bool heard_force = false;
  for (const Road road : {Road::kUnix, Road::kTcp}) {
    WorkerJudge judge(wire, report, road);
    judge.judge();
    answered = answered || judge.answered();
    heard_force = heard_force || judge.heard_force();
  }
  if (!answered || heard_force) return;
  for (const std::string_view check : {"answer-names-state", "answer-bounds"}) {
    report.not_applicable(check, "this worker sent no force");
  }
}

}  // namespace tendon::conformance
