// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <sstream>

#include "tests/protocol/examples.h"

// WIRE.md is the specification that other languages are written from: its golden datagrams are these bytes.

namespace tendon {
namespace {

using examples::Bytes;

/// One line of a golden block: hex bytes up to the semicolon; "00 x1117" is a byte so many times.
Bytes bytes_of(const std::string& line) {
  Bytes out;
  std::istringstream words(line.substr(0, line.find(';')));
  for (std::string word; words >> word;) {
    if (word[0] == 'x') {
      const auto times = static_cast<std::size_t>(std::stoul(word.substr(1)));
      out.insert(out.end(), times - 1, out.back());
    } else {
      out.push_back(static_cast<std::byte>(std::stoul(word, nullptr, 16)));
    }
  }
  return out;
}

/// The blocks that open with "```golden NAME", by name.
std::map<std::string, Bytes> golden_datagrams(const std::string& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file.is_open()) << path;
  std::map<std::string, Bytes> out;
  std::string name;
  const std::string opening = "```golden ";
  for (std::string line; std::getline(file, line);) {
    if (line.rfind(opening, 0) == 0) {
      name = line.substr(opening.size());
      out[name];
    } else if (line.rfind("```", 0) == 0) {
      name.clear();
    } else if (!name.empty()) {
      const Bytes bytes = bytes_of(line);
      out[name].insert(out[name].end(), bytes.begin(), bytes.end());
    }
  }
  return out;
}

std::string hex(const Bytes& bytes) {
  std::string out;
  for (const std::byte b : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    out += kDigits[std::to_integer<unsigned>(b) >> 4U];
    out += kDigits[std::to_integer<unsigned>(b) & 15U];
    out += ' ';
  }
  return out;
}

TEST(WireMd, ShowsTheBytesThatTheCodeWrites) {
  const auto golden = golden_datagrams(TENDON_WIRE_MD);
  const auto ours = examples::datagrams();
  EXPECT_EQ(golden.size(), ours.size());
  for (const auto& [name, bytes] : ours) {
    ASSERT_EQ(golden.count(name), 1U) << "WIRE.md has no golden " << name << ": " << hex(bytes);
    EXPECT_EQ(hex(golden.at(name)), hex(bytes)) << name;
  }
}

TEST(WireMd, ShowsBytesThatTheCodeReads) {
  const auto golden = golden_datagrams(TENDON_WIRE_MD);
  const auto hello = decode_hello(golden.at("hello"));
  ASSERT_TRUE(hello.has_value());
  EXPECT_EQ(read_hello(hello->body)->name, "wall");
  EXPECT_EQ(decode_retry(golden.at("retry"))->cookie, examples::cookie());
  EXPECT_EQ(std::get<Welcome>(*read_answer(decode_answer(golden.at("welcome"))->body)).loop_hz, 1000U);
  EXPECT_EQ(std::get<Refused>(*read_answer(decode_answer(golden.at("refused"))->body)).code, Code::kBusy);

  DataReader reader;
  const Bytes& state = golden.at("state");
  const auto* content = reader.read(std::span(state).subspan(kHeaderSize));
  ASSERT_NE(content, nullptr);
  EXPECT_EQ(std::get<DeviceState>(content->frames.at(0)).position, Vec3(0.01, 0, -0.02));
}

}  // namespace
}  // namespace tendon
