// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tendon::conformance {

/// Who is judged.
enum class Side : std::uint8_t { kServer = 1, kClient = 2, kBoth = 3, kWorker = 4 };

/// One rule of the documents. `sentence` stands there word for word, below the heading `section`, or in the header's
/// comments (tests/tools/conformance/documents_test.cc looks it up).
struct Check {
  std::string_view name;
  Side side;
  std::string_view document;  ///< "WIRE.md", "SESSION.md", "stream.h" (of clients/cpp/worker)
  std::string_view section;   ///< empty in a header
  std::string_view sentence;
};

/// Every check there is, in the order in which they are reported.
std::span<const Check> checks();

/// "WIRE.md#type-2-retry-server--client-48-bytes": where a web page of the document has the section. A header has none:
/// "stream.h".
std::string anchor(const Check& check);

enum class Outcome : std::uint8_t { kUnreached, kPassed, kFailed, kNotApplicable };

struct Verdict {
  const Check* check;
  Outcome outcome = Outcome::kUnreached;
  std::string seen;  ///< what failed; why it does not apply; empty when it passed
  std::string expected;
};

/// What has been judged of one peer so far.
///
/// Thread-safe: no.
class Report {
 public:
  /// All checks of a `side`, unreached.
  explicit Report(Side side);

  /// One observation of the rule `name`. The first that fails stays. `name` must be one of the checks of this side, or
  /// std::logic_error is thrown.
  void judge(std::string_view name, bool kept, std::string seen, std::string expected);
  /// Calls `words` for the two texts, and only on failure. Use it for rules that every datagram is checked against.
  template <class Words>
  void judge(std::string_view name, bool kept, const Words& words) {
    if (kept) return judge(name, true, {}, {});
    auto [seen, expected] = words();
    judge(name, false, std::move(seen), std::move(expected));
  }
  void not_applicable(std::string_view name, std::string why);

  std::span<const Verdict> verdicts() const noexcept { return verdicts_; }
  std::size_t count(Outcome outcome) const noexcept;
  bool failed(std::string_view name) const noexcept;
  /// Nothing failed and nothing was left unreached.
  bool passed() const noexcept;

 private:
  Verdict& find(std::string_view name);
  std::vector<Verdict> verdicts_;
};

/// One line for people, one JSON object for programs.
std::string text_of(const Verdict& verdict);
std::string json_of(const Verdict& verdict);

}  // namespace tendon::conformance
