// SPDX-License-Identifier: Apache-2.0
// Reads situations from stdin. Writes the description, and for each situation its command and its rows, as doubles of
// this machine, to stdout. bytes.test.mjs compares them with those of the page. A situation is six settings, the position
// of the hand, a number of frames, and for each frame a number of periods and the next position.
#include <iostream>
#include <memory>
#include <span>

#include "tests/tools/playground/playground.h"

int main() {
  double delay = 0;
  double jitter = 0;
  double loss = 0;
  double stiffness = 0;
  double seed = 0;
  double law = 0;
  double x = 0;
  double y = 0;
  int frames = 0;
  std::cout << playground_description();
  while (std::cin >> delay >> jitter >> loss >> stiffness >> seed >> law >> x >> y >> frames) {
    std::cout << playground_command(delay, jitter, loss, stiffness, seed, law);
    const std::unique_ptr<tendon::playground::Playground> playground(
        playground_create(delay, jitter, loss, stiffness, seed, law, x, y));
    for (int count = 0; frames > 0 && std::cin >> count >> x >> y; --frames) {
      const auto rows = std::as_bytes(playground->step(count, x, y));
      std::cout.write(reinterpret_cast<const char*>(rows.data()), static_cast<std::streamsize>(rows.size()));
    }
  }
  return std::cout && std::cin.eof() ? 0 : 1;
}
