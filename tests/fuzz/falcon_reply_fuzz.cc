// SPDX-License-Identifier: Apache-2.0
#include <vector>

#include "devices/falcon/packet.h"
#include "tests/fuzz/target.h"

// The stream arrives in arbitrary fragments. The replies must equal those found by scanning the whole stream for
// 16-byte replies. Every byte must belong to a reply, be skipped, or be the possible beginning of the next reply.

using namespace tendon;
using namespace tendon::falcon;

namespace {

bool same(const falcon::Reply& a, const falcon::Reply& b) {
  return a.encoders == b.encoders && a.buttons == b.buttons && a.homed == b.homed;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::size_t piece = 1 + data[0] % 62U;
  const std::span<const std::uint8_t> stream(data + 1, size - 1);

  std::vector<falcon::Reply> expected;
  for (std::size_t at = 0; at + kPacketBytes <= stream.size();) {
    const auto reply = decode(stream.subspan(at).first<kPacketBytes>());
    if (reply) expected.push_back(*reply);
    at += reply ? kPacketBytes : 1;
  }

  ReplyParser parser;
  std::size_t found = 0;
  for (auto left = stream; !left.empty(); left = left.subspan(std::min(piece, left.size()))) {
    const auto next = left.first(std::min(piece, left.size()));
    fuzz::require(parser.feed(next) == next.size());
    while (const auto reply = parser.next()) {
      fuzz::require(found < expected.size() && same(*reply, expected[found]));
      ++found;
    }
  }
  fuzz::require(found == expected.size());
  const std::size_t accounted = static_cast<std::size_t>(parser.left_out()) + kPacketBytes * found;
  fuzz::require(accounted <= stream.size() && stream.size() - accounted < kPacketBytes);
  return 0;
}
