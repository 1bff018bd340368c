// SPDX-License-Identifier: Apache-2.0
//
// What codec_proof_test.cc counts instructions of: a datagram with a state, and one with a force, written and read, by
// hand and by protobuf. A line for each. Callgrind counts within `in_turn`, and writes a file each time it returns.
#include <array>
#include <cstdlib>
#include <iostream>
#include <string>

#include "protocol/wire/codec.h"
#include "tests/protocol/examples.h"

using namespace tendon;

namespace {

struct Workplace {
  DataWriter writer;
  DataReader reader;
  std::array<std::byte, kMaxDatagram> buffer{};
  std::size_t frames = 0;  ///< that were read
};

const OutgoingEcho kEcho{PeerTime(std::chrono::seconds(5)), LocalTime(std::chrono::seconds(6)), 99, 0xffffffff};

template <class Value>
void write(Workplace& place, const Value& value, bool by_hand) {
  place.writer.begin(place.buffer, {.connection_id = 7}, LocalTime(std::chrono::seconds(7)), kEcho);
  const bool fits = by_hand ? place.writer.add(value) : place.writer.add_by_protobuf(value);
  if (!fits) std::abort();
}

void read(Workplace& place, bool by_hand) {
  const auto body = std::span<const std::byte>(place.buffer).first(place.writer.size()).subspan(kHeaderSize);
  const DataContent* content = by_hand ? place.reader.read(body) : place.reader.read_by_protobuf(body);
  if (content == nullptr) std::abort();
  place.frames += content->frames.size();
}

}  // namespace

/// A name that callgrind finds: not inlined, not mangled.
extern "C" [[gnu::noinline]] void in_turn(Workplace& place, bool writes, bool is_state, bool by_hand, int times) {
  static const DeviceState state = examples::state();
  static const ForceCommand force = examples::force();
  for (int i = 0; i < times; ++i) {
    if (!writes) {
      read(place, by_hand);
    } else if (is_state) {
      write(place, state, by_hand);
    } else {
      write(place, force, by_hand);
    }
  }
}

int main() {
  for (const bool is_state : {true, false}) {
    for (const bool by_hand : {true, false}) {
      Workplace place;
      for (const bool writes : {true, false}) {
        in_turn(place, writes, is_state, by_hand, 100);
        in_turn(place, writes, is_state, by_hand, 1100);
        std::cout << (writes ? "write" : "read") << (is_state ? " state" : " force")
                  << (by_hand ? " by hand" : " by protobuf") << '\n';
      }
    }
  }
}
