// SPDX-License-Identifier: Apache-2.0
#include "tests/protocol/wire/golden.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "tests/protocol/examples.h"

// Other languages test their code with protocol/vectors/golden.md.

namespace tendon::golden_test {
namespace {

using examples::Bytes;

/// Parses the hexadecimal digits in front of the semicolon. "00 x1117" repeats a byte.
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

std::string page() {
  const auto path = std::filesystem::path(TENDON_VECTORS) / "golden.md";
  std::ifstream file(path);
  EXPECT_TRUE(file.is_open()) << path;
  return {std::istreambuf_iterator<char>(file), {}};
}

std::map<std::string, Bytes> golden_datagrams() {
  std::map<std::string, Bytes> out;
  for (const auto& [name, block] : golden::blocks(page())) {
    std::istringstream lines(block);
    for (std::string line; std::getline(lines, line);) {
      const Bytes bytes = bytes_of(line);
      out[name].insert(out[name].end(), bytes.begin(), bytes.end());
    }
  }
  return out;
}

TEST(GoldenDatagrams, AreTheBytesThatTheCodeWrites) {
  const auto shown = golden::blocks(page());
  const auto bytes = golden_datagrams();
  const auto ours = examples::datagrams();
  EXPECT_EQ(shown.size(), ours.size());
  for (const auto& [name, datagram] : ours) {
    ASSERT_EQ(shown.count(name), 1U) << "golden.md has no block \"```golden " << name
                                     << "\"; write its heading and an empty "
                                     << "block, then run: protocol/generate";
    EXPECT_EQ(shown.at(name), golden::block(datagram)) << name << " is stale; run: protocol/generate";
    EXPECT_EQ(bytes.at(name), datagram) << name << ": golden.cc leaves bytes out";
  }
}

TEST(GoldenDatagrams, AreBytesThatTheCodeReads) {
  const auto golden = golden_datagrams();
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
}  // namespace tendon::golden_test
