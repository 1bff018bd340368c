// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/chai3d/needed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

namespace tendon::bridge::chai3d::needed_test {
namespace {

std::vector<std::byte> bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> text{std::istreambuf_iterator<char>(file), {}};
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

bool has(const std::vector<std::string>& libraries, const std::string& name) {
  return std::any_of(libraries.begin(), libraries.end(), [&](const std::string& one) { return one.starts_with(name); });
}

TEST(NeededLibraries, OfThisTestHaveTheCLibraryAmongThem) {
  EXPECT_TRUE(has(needed_libraries(bytes_of("/proc/self/exe")), "libc.so"));
}

TEST(NeededLibraries, OfThePhantomLibraryHaveNothingOfOurs) {
  // Protocol Buffers could conflict with the version that a program uses.
  const auto needed = needed_libraries(bytes_of(TENDON_HD_PHANTOM));
  EXPECT_TRUE(has(needed, "libc.so"));
  for (const std::string& library : needed) {
    EXPECT_TRUE(library.starts_with("libc.so") || library.starts_with("libstdc++.so") ||
                library.starts_with("libgcc_s.so") || library.starts_with("libm.so") || library.starts_with("ld-linux"))
        << library;
  }
}

TEST(NeededLibraries, OfAScriptOrOfNothingAreNone) {
  const std::string script = "#!/bin/sh\nexec ./program\n";
  EXPECT_TRUE(needed_libraries(std::as_bytes(std::span(script))).empty());
  EXPECT_TRUE(needed_libraries({}).empty());
}

TEST(NeededLibraries, OfADamagedFileAreReadWithinItsBytes) {
  const std::vector<std::byte> whole = bytes_of(TENDON_HD_PHANTOM);
  std::mt19937_64 random(7);
  for (int i = 0; i < 2000; ++i) {
    std::vector<std::byte> damaged(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(random() % whole.size()));
    for (int k = 0; k < 20 && !damaged.empty(); ++k) {
      damaged[random() % std::min<std::size_t>(damaged.size(), 1024)] = static_cast<std::byte>(random());
    }
    needed_libraries(damaged);
  }
}

}  // namespace
}  // namespace tendon::bridge::chai3d::needed_test
