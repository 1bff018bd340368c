// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <chrono>
#include <cstdint>

#include "clients/bridge/vrpn/vrpn_peer.h"
#include "tests/clients/bridge/vrpn/program.h"
#include "tests/fuzz/target.h"

// The input is TCP fragments and datagrams. Rendered forces must be finite, it must be possible to parse the answers,
// and stored data must stay within the limits.

using namespace tendon;
using namespace tendon::bridge;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  std::array<vrpn::Station, 2> stations;
  stations[0].name = "Phantom0";
  stations[1].name = "Phantom1";
  vrpn::Moment now{LocalTime(std::chrono::seconds(1)), std::chrono::seconds(1)};
  vrpn::Peer peer(stations, now);
  vrpn::Reader reader;
  bool first = true;
  const vrpn::Program program;
  if ((input.byte() & 1U) != 0) {  // otherwise the input has to contain the right cookie
    peer.take_stream(now, program.hello());
    peer.take_stream(now, vrpn::Program::description(vrpn::Program::kSender, vrpn::kSenderDescription, "Phantom0"));
    peer.take_stream(now, vrpn::Program::all_types(0));
  }
  DeviceState state;
  while (!input.empty()) {
    const std::uint8_t what = input.byte();
    const auto bytes = input.take(input.byte());
    if ((what & 1U) != 0) {
      peer.take_datagram(now, bytes);
    } else {
      peer.take_stream(now, bytes);
    }
    if ((what & 2U) != 0) peer.end_of_batch(now);
    now.at += std::chrono::microseconds(what * 100);
    now.since_1970 += std::chrono::microseconds(what * 100);
    state.tick += what >> 4U;
    state.buttons = what;
    for (std::size_t i = 0; i < stations.size(); ++i) {
      peer.report(now, i, state, {});
      fuzz::require(peer.drawing(i).touch({Vec3(1e-3, -1e-3, 1e-3), Vec3(1, 0, 0)}, 1000).force.allFinite());
      fuzz::require(peer.freshness(i).until() > now.at - std::chrono::hours(1));
    }
    while (peer.next_sentence()) {
    }
    for (const vrpn::Buffer& datagram : peer.datagrams()) {
      fuzz::require(datagram.size() <= vrpn::kLongestDatagram);
      if (!first) reader.take(datagram);
    }
    peer.datagrams().clear();
    fuzz::require(peer.stream().size() <= vrpn::Peer::kMaxUnread + 4096);
    if (!peer.open()) continue;
    const vrpn::Buffer stream(peer.stream().begin(), peer.stream().end());
    peer.sent(stream.size());
    reader.take(stream, std::exchange(first, false));
  }
  return 0;
}
