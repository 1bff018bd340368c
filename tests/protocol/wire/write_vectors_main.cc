// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "tests/protocol/wire/vectors.h"

// After a change of the wire that was meant: writes protocol/vectors/ anew. The diff is the change.

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::cerr << "usage: write_vectors FOLDER      Example: write_vectors protocol/vectors\n";
    return 2;
  }
  for (const auto& [name, text] : tendon::vectors::files()) {
    std::ofstream file(std::filesystem::path(argv[1]) / name, std::ios::binary);
    if (!(file << text << std::flush)) {
      std::cerr << "cannot write " << name << " in " << argv[1] << '\n';
      return 1;
    }
  }
  return 0;
}
