// SPDX-License-Identifier: Apache-2.0
#include <span>
#include <stdexcept>
#include <string>

#include "protocol/discovery.h"
#include "tests/fuzz/target.h"

// A name must be rejected or unchanged by writing and parsing. A parsed TXT record can be parsed again.

using namespace tendon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span<const std::byte> bytes = std::as_bytes(std::span(data, size));
  const std::string text(reinterpret_cast<const char*>(data), size);
  try {
    const dns_sd::Instance instance = dns_sd::parse_instance(text);
    fuzz::require(instance.name.empty() || dns_sd::is_instance_name(instance.name));
    fuzz::require(dns_sd::is_domain(instance.domain));
    fuzz::require(dns_sd::parse_instance(to_string(instance)) == instance);
    fuzz::require(instance.name.empty() || dns_sd::is_instance_name(dns_sd::another_name(instance.name, 100)));
  } catch (const std::invalid_argument&) {
  }
  const dns_sd::About about = dns_sd::read_txt(dns_sd::split_txt(bytes));
  fuzz::require(dns_sd::read_txt(dns_sd::to_txt(about)) == about);
  return 0;
}
