// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/json.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace tendon::dash {
namespace {

TEST(DashJson, IsReadBackAsItWasWritten) {
  JsonWriter json;
  json.begin_object().key("a").value("x").key("b").begin_array().value(1.5).value(std::uint64_t{18446744073709551615U});
  json.value(false).null().begin_object().end_object().end_array().key("c").begin_array().end_array().end_object();
  EXPECT_EQ(json.text(), R"({"a":"x","b":[1.5,18446744073709551615,false,null,{}],"c":[]})");
}

TEST(DashJson, EscapesWhatATextMayNotHold) {
  const std::string evil = std::string("\"\\\n\r\t\x01</script>ä€😀\x7f") + '\0';
  JsonWriter json;
  json.value(evil);
  EXPECT_EQ(nlohmann::json::parse(json.text()).get<std::string>(), evil);
}

TEST(DashJson, ReplacesBytesThatAreNoUtf8) {
  for (const std::string bad :
       {"\x80", "\xC0\x80", "\xE0\x80\x80", "\xED\xA0\x80", "\xF4\x90\x80\x80", "\xF8\x88\x80\x80\x80", "\xE2\x82"}) {
    EXPECT_FALSE(is_plain_text(bad));
    JsonWriter json;
    json.value("a" + bad + "b");
    const auto text = nlohmann::json::parse(json.text()).get<std::string>();
    EXPECT_TRUE(text.starts_with("a\xEF\xBF\xBD") && text.ends_with("b")) << text;
  }
}

TEST(DashJson, HasNoNumberForWhatIsNone) {
  JsonWriter json;
  json.begin_array()
      .value(std::nan(""))
      .value(std::numeric_limits<double>::infinity())
      .value(-HUGE_VALF)
      .value(0.1F)
      .value(0.1);
  EXPECT_EQ(json.end_array().text(), "[null,null,null,0.1,0.1]");
}

TEST(DashJson, PlainTextHasNoControlCharacters) {
  EXPECT_TRUE(is_plain_text("Lauf 7, größer 😀.mcap"));
  for (const std::string_view bad : {std::string_view("a\nb"), std::string_view("a\0b", 3), std::string_view("\x7f")}) {
    EXPECT_FALSE(is_plain_text(bad));
  }
}

}  // namespace
}  // namespace tendon::dash
