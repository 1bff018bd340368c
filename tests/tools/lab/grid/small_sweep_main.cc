// SPDX-License-Identifier: Apache-2.0
// small_sweep SCENE: a small sweep for same_table.sh, without the other commands of tendon-lab.
#include <exception>
#include <iostream>

#include "tests/tools/lab/grid/grid.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: small_sweep SCENE\n";
    return 2;
  }
  try {
    tendon::lab::GridOptions options;
    options.scene = argv[1];
    options.networks = "delay={1,20}ms loss=burst(2%,3),wifi-bad,leo-satellite,netfi-delay-1";
    options.stiffness = "300,2000";
    options.laws = "none,aol,energy-bounding,tdpa,feel";
    options.length_s = 2;
    tendon::lab::run_grid(options, std::cout);
  } catch (const std::exception& error) {
    std::cerr << "small_sweep: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
