// SPDX-License-Identifier: Apache-2.0
// fake_worker [WAY [AFTER]] SCENE: pulls the hand to the origin. WAY selects how it fails after AFTER answers.
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "clients/cpp/worker/worker.h"

using namespace tendon;

namespace {

/// It runs in its own process group, like the ranks of Open MPI, and ignores all signals that can be ignored.
void leave_a_child() {
  if (::fork() != 0) return;
  ::setsid();
  for (const int signal : {SIGTERM, SIGHUP, SIGINT}) std::signal(signal, SIG_IGN);
  for (;;) ::pause();
}

}  // namespace

int main(int argc, char** argv) {
  const std::string way = argc > 1 ? argv[1] : "well";
  const int after = argc > 2 ? std::atoi(argv[2]) : 0;
  if (way == "with-a-child") leave_a_child();
  if (way == "ends-at-once") return 3;
  if (way == "never-opens") ::pause();
  worker::WorkerStream stream;
  worker::Codec codec;
  int answers = 0;
  while (const auto record = stream.next()) {
    const auto hand = codec.read_state(*record);
    if (!hand) return 1;
    Touch touch = Vec3(-200.0 * hand->position);
    touch.stiffness = 200.0 * Mat3::Identity();
    touch.error = 0.01;
    std::uint64_t sequence = record->sequence;
    if (answers++ >= after) {
      if (way == "dies") std::raise(SIGKILL);
      if (way == "stops") std::raise(SIGSTOP);
      if (way == "exits") return 7;
      if (way == "is-slow") ::usleep(120'000);
      while (way == "sleeps") ::pause();
      if (way == "nan") touch.force.x() = std::numeric_limits<double>::quiet_NaN();
      if (way == "another-sequence") ++sequence;
      if (way == "babbles") {
        for (int i = 0; i < 1000 && stream.send({.sequence = sequence, .body = {std::byte{0x12}, std::byte{0x99}}});
             ++i) {
        }
      }
      if (way == "shouts") stream.send({.sequence = sequence, .body = std::vector<std::byte>(2000)});
    }
    if (!stream.send(codec.answer(sequence, *hand, touch))) return 0;
  }
  return 0;
}
