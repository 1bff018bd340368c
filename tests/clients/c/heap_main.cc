// SPDX-License-Identifier: Apache-2.0
// heap SERVER STATES PAUSE_US [KEY]: counts the heap calls of tendon_wait() and tendon_send().
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <optional>

#include "clients/c/tendon.h"
#include "tests/realtime/heap_guard.h"

int main(int count, char** words) {
  if (count < 4) return 2;
  char why[200];
  tendon_config config{};
  config.size = sizeof config;
  config.server = words[1];
  config.key_file = count > 4 ? words[4] : nullptr;
  tendon_client* const client = tendon_open(&config, why, sizeof why);
  if (client == nullptr) {
    std::fprintf(stderr, "%s\n", why);
    return 1;
  }
  const int states = std::atoi(words[2]);
  tendon_state hand{};
  hand.size = sizeof hand;
  tendon_force force{};
  force.size = sizeof force;
  force.has = TENDON_FORCE_STIFFNESS;
  std::optional<tendon::HeapGuard> guard;
  int turns = 0;
  // The first second contains the description of the device, and the first report of the server.
  for (int i = 0; i < states && tendon_wait(client, &hand, 5'000'000'000) == TENDON_OK; ++i) {
    if (i == states / 4) guard.emplace();
    force.tick = hand.tick;
    force.force[0] = -100 * hand.position[0];
    if (tendon_send(client, &force) != TENDON_OK) break;
    if (std::atoi(words[3]) > 0) ::usleep(static_cast<unsigned>(std::atoi(words[3])));
    turns += guard ? 1 : 0;
  }
  const unsigned long long calls = guard ? guard->calls() : 1;
  guard.reset();
  std::printf("{\"turns\":%d,\"heap_calls\":%llu,\"why\":\"%s\"}\n", turns, calls, tendon_why(client));
  tendon_close(client);
  return 0;
}
