// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

namespace tendon {

/// Returns the message of the `Error` thrown by `call`, or an empty string if it does not throw.
template <class Error = std::invalid_argument, class Call>
std::string thrown_by(Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

/// For EXPECT_PRED2(says, text, part), which prints both.
inline bool says(std::string_view text, std::string_view part) { return text.find(part) != std::string_view::npos; }

template <class T>
struct Makes {
  void operator()(const auto& config) const { [[maybe_unused]] const T made(config); }
};

/// One row of a table. A valid configuration is made invalid by `change`, and the error message must contain `says`.
template <class Config>
struct Spoiled {
  std::string_view says;
  void (*change)(Config&);
};

/// Checks that `use(good)` does not throw, and that with each row it throws an `Error` with the expected message.
template <class Error = std::invalid_argument, class Config, class Use>
void expect_refusals(const Config& good, Use use, std::initializer_list<Spoiled<std::type_identity_t<Config>>> rows) {
  EXPECT_EQ(thrown_by<Error>([&] { use(good); }), "") << "the configuration without a change";
  for (const auto& [says, change] : rows) {
    Config config = good;
    change(config);
    const std::string message = thrown_by<Error>([&] { use(config); });
    if (message.find(says) != std::string::npos && !message.empty()) continue;
    ADD_FAILURE() << (message.empty() ? "nothing was refused" : message) << "\nexpected: " << says;
  }
}

}  // namespace tendon
