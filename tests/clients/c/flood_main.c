// SPDX-License-Identifier: Apache-2.0
// Answers one state with as many forces as possible for two seconds, without waiting for another state.
#include <stdio.h>
#include <time.h>

#include "tendon.h"

int main(int count, char** words) {
  char why[200];
  tendon_config config = {.size = sizeof config, .server = words[1]};
  tendon_client* client = count == 2 ? tendon_open(&config, why, sizeof why) : NULL;
  if (client == NULL) return fprintf(stderr, "flood: %s\n", why), 1;
  tendon_state hand = {.size = sizeof hand};
  if (tendon_wait(client, &hand, 5000000000) != TENDON_OK) return fprintf(stderr, "%s\n", tendon_why(client)), 1;
  tendon_force force = {.size = sizeof force, .tick = hand.tick, .force = {-1, 0, 0}};
  long sent = 0;
  const time_t end = time(NULL) + 3;
  while (time(NULL) < end) sent += tendon_send(client, &force) == TENDON_OK;
  printf("{\"sent\":%ld}\n", sent);
  fflush(stdout);
  tendon_close(client);
  return 0;
}
