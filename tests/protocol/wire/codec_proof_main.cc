// SPDX-License-Identifier: Apache-2.0
// This program is used by codec_proof_test.cc. A state, a force, and 16 states in columns are written and read with our
// codec and with libprotobuf. One line is printed for each of them. Callgrind counts within `in_turn` and writes a file
// each time the function returns.
#include <array>
#include <cstdlib>
#include <iostream>
#include <string>

#include "protocol/wire/codec.h"
#include "tendon.pb.h"
#include "tests/protocol/examples.h"

using namespace tendon;

namespace {

struct Workplace {
  DataWriter writer;
  DataReader reader;
  std::array<std::byte, kMaxDatagram> buffer{};
  std::size_t frames = 0;  ///< frames read
  v1::Datagram object;
};

enum class What { kState, kForce, kColumns };

struct Step {
  std::array<DeviceState, limits::kMaxDevices> states;
  std::array<const DeviceState*, limits::kMaxDevices> each;
  Step() {
    states.fill(examples::state());
    for (std::uint32_t i = 0; i < states.size(); ++i) {
      states[i].device = i;
      each[i] = &states[i];
    }
  }
};

const OutgoingEcho kEcho{PeerTime(std::chrono::seconds(5)), LocalTime(std::chrono::seconds(6)), 99, 0xffffffff};

template <class Value>
void write(Workplace& place, const Value& value, bool by_hand) {
  if (!by_hand) {
    if (!place.object.SerializeToArray(place.buffer.data() + kHeaderSize, kMaxDatagram - kHeaderSize)) std::abort();
    return;
  }
  place.writer.begin(place.buffer, {.connection_id = 7}, LocalTime(std::chrono::seconds(7)), kEcho);
  if (!place.writer.add(value)) std::abort();
}

void read(Workplace& place, bool by_hand) {
  const auto body = std::span<const std::byte>(place.buffer).first(place.writer.size()).subspan(kHeaderSize);
  if (!by_hand) {
    if (!place.object.ParseFromArray(body.data(), static_cast<int>(body.size()))) std::abort();
    return;
  }
  const DataContent* content = place.reader.read(body);
  if (content == nullptr) std::abort();
  place.frames += content->frames.size();
}

}  // namespace

/// This function is neither inlined nor mangled, so callgrind can find it.
extern "C" [[gnu::noinline]] void in_turn(Workplace& place, bool writes, What what, bool by_hand, int times) {
  static const DeviceState state = examples::state();
  static const ForceCommand force = examples::force();
  static const Step step;
  for (int i = 0; i < times; ++i) {
    if (!writes) {
      read(place, by_hand);
    } else if (what == What::kState) {
      write(place, state, by_hand);
    } else if (what == What::kForce) {
      write(place, force, by_hand);
    } else {
      write(place, std::span<const DeviceState* const>(step.each), by_hand);
    }
  }
}

int main() {
  for (const auto& [what, name] :
       {std::pair{What::kState, "state"}, {What::kForce, "force"}, {What::kColumns, "columns"}}) {
    Workplace place;
    for (const bool by_hand : {true, false}) {
      for (const bool writes : {true, false}) {
        in_turn(place, writes, what, by_hand, 100);
        in_turn(place, writes, what, by_hand, 1100);
        std::cout << (writes ? "write " : "read ") << name << (by_hand ? " by hand" : " by protobuf") << '\n';
        if (by_hand) read(place, false);
      }
    }
  }
}
