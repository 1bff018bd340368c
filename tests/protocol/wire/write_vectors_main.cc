// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <stdexcept>
#include <string>

#include "tests/protocol/wire/golden.h"
#include "tests/protocol/wire/vectors.h"

// Rewrites protocol/vectors/ after an intended change of the wire format, so that the change is visible as a diff. It
// is run by protocol/generate, which also runs protoc for the Python and TypeScript clients.

namespace {

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  if (!(file << text << std::flush)) throw std::runtime_error("cannot write " + path.string());
}

std::string read(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(file), {});
  if (!file) throw std::runtime_error("cannot read " + path.string());
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2 || argv[1][0] == '-') {
    std::cerr << "usage: write_vectors FOLDER      Example: write_vectors protocol\n";
    return 2;
  }
  const std::filesystem::path protocol = argv[1];
  try {
    const std::filesystem::path folder = protocol / "vectors";
    for (const auto& [name, text] : tendon::vectors::files()) write(folder / name, text);
    write(folder / "golden.md", tendon::golden::rewritten(read(folder / "golden.md")));
  } catch (const std::exception& e) {
    std::cerr << e.what() << '\n';
    return 1;
  }
  return 0;
}
