// SPDX-License-Identifier: Apache-2.0
// A wall of 2000 N/m at x = 0: cc wall.c -ltendon && ./a.out SERVER STATES
#include <stdio.h>
#include <stdlib.h>
#include <tendon.h>

int main(int count, char** words) {
  char why[200];
  tendon_config config = {.size = sizeof config, .server = count > 1 ? words[1] : "127.0.0.1:47100", .name = "wall.c"};
  tendon_client* client = tendon_open(&config, why, sizeof why);
  if (client == NULL) return fprintf(stderr, "wall: %s\n", why), 1;
  tendon_state hand = {.size = sizeof hand};
  tendon_force wall = {.size = sizeof wall, .has = TENDON_FORCE_STIFFNESS};
  for (int left = count > 2 ? atoi(words[2]) : 10000; left > 0 && tendon_wait(client, &hand, 1000000000) == 0; --left) {
    wall.tick = hand.tick;
    wall.stiffness[0] = hand.position[0] > 0 ? 2000 : 0;
    wall.force[0] = -wall.stiffness[0] * hand.position[0];
    if (tendon_send(client, &wall) < 0) break;
  }
  printf("x %.2f mm, %.2f N on the hand. %s\n", 1e3 * hand.position[0], hand.force_applied[0], tendon_why(client));
  tendon_close(client);
}
