// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tendon::conformance {

enum class Side : std::uint8_t { kServer = 1, kClient = 2, kBoth = 3, kWorker = 4 };

/// `sentence` is a literal quotation from `section`, or from the comments of a header (see documents_test.cc).
struct Check {
  std::string_view name;
  Side side;
  std::string_view document;  ///< "WIRE.md", "SESSION.md", "vectors/golden.md", "stream.h" (of clients/cpp/worker)
  std::string_view section;   ///< empty: the whole document
  std::string_view sentence;
};

std::span<const Check> checks();

/// Returns the document and the anchor of the section, if any, for example
/// "WIRE.md#type-2-retry-server--client-48-bytes".
std::string anchor(const Check& check);

enum class Outcome : std::uint8_t { kUnreached, kPassed, kFailed, kNotApplicable };

struct Verdict {
  const Check* check;
  Outcome outcome = Outcome::kUnreached;
  std::string seen;  ///< the failure, or why the check does not apply; empty if it passed
  std::string expected;
};

/// Thread-safe: no.
class Report {
 public:
  /// Creates a report in which all checks of `side` are unreached.
  explicit Report(Side side);

  /// Keeps the first failure. Throws std::logic_error if `name` is not a check of this side.
  void judge(std::string_view name, bool kept, std::string seen, std::string expected);
  /// Calls `words` for the two texts only on failure.
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
  bool passed() const noexcept;

 private:
  Verdict& find(std::string_view name);
  std::vector<Verdict> verdicts_;
};

std::string text_of(const Verdict& verdict);
std::string json_of(const Verdict& verdict);

}  // namespace tendon::conformance
