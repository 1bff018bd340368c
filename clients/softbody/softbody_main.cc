// SPDX-License-Identifier: Apache-2.0
// tendon-softbody: the reference physics engine, a guest like any other.
#include <exception>
#include <iostream>
#include <string>
#include <string_view>

#include "clients/cpp/options.h"
#include "clients/softbody/placed_body.h"

using namespace tendon;

int main(int argc, char** argv) {
  const bool explains = argc > 1 && std::string_view(argv[1]) == "explain";
  Options options{.client = {.name = explains ? "tendon-softbody explain" : "tendon-softbody", .rate_hz = 500}};
  std::string file;
  CommandLine line(explains
                       ? "Says what a scene simulates, what not, and what each part costs; no server is needed."
                       : "A soft body that the hand can touch; `tendon-softbody explain SCENE` says what it simulates.",
                   options);
  line.add_argument("SCENE", file, "Scene file; its keys:\n" + softbody::scene_reference());
  if (const auto exit_code = line.parse(explains ? argc - 1 : argc, explains ? argv + 1 : argv)) return *exit_code;

  try {
    const softbody::Scene scene = softbody::read_scene(file);
    if (explains) {
      std::cout << softbody::explain(scene);
      return 0;
    }
    for (const std::string& warning : softbody::warnings(scene.body)) {
      std::cerr << "tendon-softbody: warning: " << warning << '\n';
    }
    softbody::PlacedBody body(scene);
    return run(options, [&](const DeviceState& hand) { return body.answer(hand); });
  } catch (const std::exception& error) {
    std::cerr << "tendon-softbody: " << error.what() << '\n';
    return 1;
  }
}
