// SPDX-License-Identifier: Apache-2.0
// A wall that is built with the first version of tendon.h and with a later one. Prints what the library has filled in.
#include <stdio.h>
#include <string.h>

#include "tendon.h"

int main(int count, char** words) {
  char why[200];
  tendon_config config = {.size = sizeof config, .server = words[1], .name = "abi"};
  tendon_client* client = count == 2 ? tendon_open(&config, why, sizeof why) : NULL;
  if (client == NULL) return fprintf(stderr, "abi_program: %s\n", why), 1;
  struct {
    tendon_state state;
    unsigned char after[256];
  } hand;
  memset(&hand, 0xa5, sizeof hand);
  hand.state.size = sizeof hand.state;
  tendon_force wall = {.size = sizeof wall, .has = TENDON_FORCE_STIFFNESS};
  tendon_description device = {.size = sizeof device};
  const int described = tendon_describe(client, &device, 5000000000);
  int states = 0;
  int sent = 0;
  while (states < 700 && tendon_wait(client, &hand.state, 5000000000) == TENDON_OK) {
    ++states;
    wall.tick = hand.state.tick;
    wall.stiffness[0] = hand.state.position[0] > 0 ? 2000 : 0;
    wall.force[0] = -wall.stiffness[0] * hand.state.position[0];
    sent += tendon_send(client, &wall) == TENDON_OK;
  }
  int changed = 0;
  for (size_t i = 0; i < sizeof hand.after; ++i) changed += hand.after[i] != 0xa5;
  printf(
      "{\"states\":%d,\"sent\":%d,\"changed\":%d,\"force_n\":%g,\"described\":%d,\"max_force\":%g,\"size\":%u,"
      "\"own_size\":%zu,\"header\":%u,\"library\":%u}\n",
      states, sent, changed, hand.state.force_applied[0], described, device.max_force, hand.state.size,
      sizeof hand.state, TENDON_ABI, tendon_abi());
  tendon_close(client);
  return 0;
}
