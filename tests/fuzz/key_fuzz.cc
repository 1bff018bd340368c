// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>

#include "protocol/secrets/client_key.h"
#include "tests/fuzz/target.h"

// A file must either be rejected or accepted. If it is rejected, the message must not contain the key. If it is
// accepted, only the owner can read the file, the key is not weak, and it is unchanged by writing and parsing.

using namespace tendon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  const unsigned mode = input.byte() % 4 == 0 ? 0100600U | input.byte() : 0100600U;
  const std::string_view text = fuzz::text(input.rest());
  try {
    const ClientKey key = read_key_file(text, mode, "a");
    fuzz::require((mode & 077U) == 0 && !weakness(key.key));
    const ClientKey again = read_key_file(key_file_text(key), mode, "a");
    fuzz::require(again.role == key.role && again.key.bytes() == key.key.bytes());
  } catch (const std::invalid_argument& refused) {
    constexpr std::string_view kDigits = "0123456789abcdefABCDEF";
    const std::string_view sentence = refused.what();
    for (std::size_t at = 0; at < sentence.size(); ++at) {  // the longest key that lacks only one digit
      const std::size_t end = std::min(sentence.find_first_not_of(kDigits, at), sentence.size());
      fuzz::require(end - at < 63);
    }
  }
  return 0;
}
