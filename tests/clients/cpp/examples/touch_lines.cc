// SPDX-License-Identifier: Apache-2.0
// touch_lines EXAMPLE [ARGUMENT…]: runs a rendering example, which is linked unchanged, without a server. For each
// input line "DEVICE X Y Z U V W" (m, m/s), it prints "FX FY FZ" in N and, if the example sends a stiffness, its nine
// elements in N/m by rows.
#include <cstdio>
#include <cstring>
#include <iostream>
#include <map>
#include <string>

#include "clients/cpp/run.h"

// The examples' main functions are renamed at compile time.
#define TENDON_EXAMPLE(name) int name##_main(int argc, char** argv);
TENDON_EXAMPLES
#undef TENDON_EXAMPLE

namespace tendon {

int run(const Options&, const std::map<std::string, Physics>& physics) {
  std::string device;
  Vec3 x, v;
  while (std::cin >> device >> x.x() >> x.y() >> x.z() >> v.x() >> v.y() >> v.z()) {
    DeviceState hand;
    hand.position = x;
    hand.velocity = v;
    const Touch touch = physics.at(device)(hand);
    std::printf("%.17g %.17g %.17g", touch.force.x(), touch.force.y(), touch.force.z());
    for (int i = 0; touch.stiffness && i < 9; ++i) std::printf(" %.17g", (*touch.stiffness)(i / 3, i % 3));
    std::printf("\n");
  }
  return 0;
}

int run(const Options& options, Physics physics) {
  return run(options, std::map<std::string, Physics>{{"any", std::move(physics)}});
}

}  // namespace tendon

int main(int argc, char** argv) {
#define TENDON_EXAMPLE(name) \
  if (argc > 1 && std::strcmp(argv[1], #name) == 0) return name##_main(argc - 1, argv + 1);
  TENDON_EXAMPLES
#undef TENDON_EXAMPLE
  std::fprintf(stderr, "touch_lines: expected the name of an example\n");
  return 2;
}
