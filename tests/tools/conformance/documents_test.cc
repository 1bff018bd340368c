// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <string_view>

#include "tests/tools/conformance/datagram.h"
#include "tests/tools/conformance/golden.h"
#include "tests/tools/conformance/report.h"

namespace tendon::conformance::documents_test {
namespace {

/// A page such as "WIRE.md", or the comments of "stream.h".
std::string text_of_file(const std::string& name) {
  const std::filesystem::path source(TENDON_SOURCE);
  const bool is_header = name.ends_with(".h");
  std::ifstream stream(source / (is_header ? "clients/cpp/worker" : "protocol") / name);
  if (!is_header) return {std::istreambuf_iterator<char>(stream), {}};
  std::string text;
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with("// ")) text += line.substr(3) + '\n';
  }
  return text;
}

std::string words(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '*' || c == '`') continue;
    const bool space = c == ' ' || c == '\n';
    if (space && out.ends_with(' ')) continue;
    out += space ? ' ' : c;
  }
  return out;
}

/// From this heading to the next one of the same or a higher rank, or empty. Without a title, the whole text.
std::string section(const std::string& text, std::string_view title) {
  if (title.empty()) return text;
  std::string heading = "\n## ";
  heading.append(title).append("\n");
  const auto begin = text.find(heading);
  if (begin == std::string::npos) return {};
  return text.substr(begin, text.find("\n## ", begin + 1) - begin);
}

TEST(ConformanceDocuments, EverySentenceOfACheckStandsInItsSection) {
  for (const Check& check : checks()) {
    const std::string found = section(text_of_file(std::string(check.document)), check.section);
    EXPECT_FALSE(found.empty()) << check.name << ": no section " << check.section;
    EXPECT_NE(words(found).find(words(check.sentence)), std::string::npos)
        << check.name << ": " << check.document << ", " << check.section << " does not say: " << check.sentence;
  }
}

TEST(ConformanceDocuments, EveryCheckHasANameOfItsOwn) {
  std::set<std::string_view> names;
  for (const Check& check : checks()) EXPECT_TRUE(names.insert(check.name).second) << check.name;
}

TEST(ConformanceDocuments, WhatTheKitSaysWordForWordIsInTheVectors) {
  const std::string vectors = text_of_file("vectors/plain.json");
  for (const char* golden : {golden::kRandom, golden::kHello, golden::kState, golden::kControl}) {
    EXPECT_NE(vectors.find(golden), std::string::npos) << golden;
  }
}

TEST(ConformanceDocuments, TheKitsOwnHandshakeDatagramsAreTheGoldenOnes) {
  const std::string vectors = text_of_file("vectors/plain.json");
  const auto in_vectors = [&](const Bytes& datagram) {
    std::string digits = hex(datagram, datagram.size());
    std::erase(digits, ' ');
    return vectors.find(digits) != std::string::npos;
  };
  const Sixteen random = sixteen(from_hex(golden::kRandom), 0);
  const Sixteen cookie = sixteen(from_hex("c0c1c2c3c4c5c6c7c8c9cacbcccdcecf"), 0);
  EXPECT_TRUE(in_vectors(hello(0, random, cookie, from_hex(golden::kHello))) ||
              in_vectors(hello(0, random, {}, from_hex(golden::kHello))));
  EXPECT_TRUE(in_vectors(retry(0, random, cookie)));
  EXPECT_TRUE(in_vectors(answer(0, 0x11223344, random, {})));
}

}  // namespace
}  // namespace tendon::conformance::documents_test
