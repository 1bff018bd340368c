// SPDX-License-Identifier: Apache-2.0
#include "tests/support/json_line.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

namespace tendon::json_line_test {
namespace {

TEST(JsonLine, MembersComeInTheOrderInWhichTheyWereAdded) {
  JsonLine inner;
  inner.add("z", 1).add("a", std::uint64_t{18446744073709551615U});
  const std::string text = JsonLine()
                               .add("text", "here")
                               .add("on", true)
                               .add("below", -3)
                               .add("share", 0.1)
                               .add("inner", inner)
                               .add("why", std::vector<std::string>{"one", "two"})
                               .add("none", std::optional<double>())
                               .add("some", std::optional(2U))
                               .str();
  EXPECT_EQ(text, R"({"text":"here","on":true,"below":-3,"share":0.1,"inner":{"z":1,"a":18446744073709551615},)"
                  R"("why":["one","two"],"none":null,"some":2})");
}

TEST(JsonLine, ANumberThatIsNotFiniteIsNull) {
  const std::string text = JsonLine()
                               .add("nan", std::numeric_limits<double>::quiet_NaN())
                               .add("inf", -std::numeric_limits<double>::infinity())
                               .str();
  EXPECT_EQ(text, R"({"nan":null,"inf":null})");
}

TEST(JsonLine, AnyBytesGiveALineThatAParserTakes) {
  std::string bytes;
  for (int byte = 0; byte < 256; ++byte) bytes += static_cast<char>(byte);
  const std::string text = JsonLine().add(bytes, bytes).add("end", 1).str();
  EXPECT_EQ(text.find('\n'), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(text).at("end"), 1);
}

TEST(JsonLine, NumbersAreReadBackTheSame) {
  for (const double value : {0.1, 1e300, -5e-300, 1.0 / 3, 123456789.0}) {
    EXPECT_EQ(nlohmann::json::parse(JsonLine().add("x", value).str()).at("x"), value);
  }
  EXPECT_EQ(with_decimals(1.23456, 2), 1.23);
}

}  // namespace
}  // namespace tendon::json_line_test
