// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/handshake_codec.h"
#include "protocol/wire/header.h"
#include "tests/fuzz/target.h"

// Parses the unencrypted header and the layout of the handshake. Parsed values must encode to the same bytes.

using namespace tendon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto datagram = std::as_bytes(std::span(data, size));
  const auto header = decode_header(datagram);
  if (header) {
    const auto again = encode_header(*header);
    fuzz::require(std::equal(again.begin(), again.end(), datagram.begin()));
  }
  std::array<std::byte, kMaxDatagram> buffer;
  const auto same = [&](std::size_t written) {
    fuzz::require(
        std::equal(datagram.begin(), datagram.end(), buffer.begin(), buffer.begin() + static_cast<long>(written)));
  };
  if (const auto hello = decode_hello(datagram)) same(encode(*hello, buffer));
  if (const auto retry = decode_retry(datagram)) same(encode(*retry, buffer));
  if (const auto answer = decode_answer(datagram)) same(encode(*answer, buffer));
  return 0;
}
