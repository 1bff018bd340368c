// Put by a test.
// SPDX-License-Identifier: Apache-2.0
#include <string_view>
namespace precice {
struct Participant {
  Participant(std::string_view, std::string_view, int, int) {}
  void initialize() {}
};
}  // namespace precice
