// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/surface/surface_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <system_error>

#include "clients/softbody/fem/file_text.h"

namespace tendon::softbody {
namespace {

std::string in_lower_case(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  return lower;
}

class SurfaceWords {
 public:
  SurfaceWords(std::string_view text, std::string_view name) : rest_(without_mark(text, name)), name_(name) {}

  /// Returns an empty list at the end of the file. Comments are ignored.
  const std::vector<std::string_view>& next() {
    words_.clear();
    while (words_.empty() && !rest_.empty()) add_line();
    return words_;
  }

  /// A backslash at the end joins two lines.
  const std::vector<std::string_view>& next_continued() {
    do {
      next();
      while (!words_.empty() && words_.back().ends_with('\\')) {
        words_.back().remove_suffix(1);
        if (words_.back().empty()) words_.pop_back();
        if (!rest_.empty()) add_line();
      }
    } while (words_.empty() && !rest_.empty());
    return words_;
  }

  [[noreturn]] void fail(const std::string& what) const {
    refuse_file(name_, "line " + std::to_string(line_) + ": " + what);
  }
  double number(std::string_view word) const {
    double value = 0;
    const auto [end, error] =
        std::from_chars(word.data() + (word.starts_with('+') ? 1 : 0), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
      fail("expected a number, found \"" + std::string(word) + '"');
    }
    return value;
  }
  long whole(std::string_view word) const {
    long value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) {
      fail("expected a whole number, found \"" + std::string(word) + '"');
    }
    return value;
  }
  Vec3 point(std::size_t from) const {
    if (words_.size() < from + 3) fail("expected three numbers");
    return {number(words_[from]), number(words_[from + 1]), number(words_[from + 2])};
  }

 private:
  void add_line() {
    ++line_;
    const std::size_t end = std::min(rest_.find_first_of("\r\n"), rest_.size());
    std::string_view line = rest_.substr(0, end);
    const bool two = rest_.substr(end).starts_with("\r\n");
    rest_.remove_prefix(std::min(end + (two ? 2 : 1), rest_.size()));
    line = line.substr(0, line.find('#'));
    while (!line.empty()) {
      const std::size_t begin = line.find_first_not_of(" \t\v\f");
      if (begin == std::string_view::npos) break;
      line.remove_prefix(begin);
      const std::size_t size = std::min(line.find_first_of(" \t\v\f"), line.size());
      words_.push_back(line.substr(0, size));
      line.remove_prefix(size);
    }
  }

  std::string_view rest_;
  std::string_view name_;
  std::size_t line_ = 0;
  std::vector<std::string_view> words_;
};

void add_triangle(Facets& to, const std::array<Vec3, 3>& corners) {
  for (const Vec3& corner : corners) {
    to.corners.push_back(static_cast<int>(to.points.size()));
    to.points.push_back(corner);
  }
  to.ends.push_back(to.corners.size());
}

Facets read_binary_stl(std::string_view bytes, std::string_view name) {
  static_assert(std::endian::native == std::endian::little, "STL is little-endian");
  Facets made{.points = {}, .each_by_itself = true};
  for (std::size_t from = kStlHead; from < bytes.size(); from += kStlFacet) {
    std::array<float, 9> numbers{};
    std::memcpy(numbers.data(), bytes.data() + from + 12, sizeof numbers);
    if (!std::ranges::all_of(numbers, [](float number) { return std::isfinite(number); })) {
      refuse_file(name, "facet " + std::to_string(made.ends.size() + 1) + ": a number is not finite");
    }
    std::array<Vec3, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) corners[i] = Vec3(numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]);
    add_triangle(made, corners);
  }
  return made;
}

/// Line breaks are ignored, except after a name.
Facets read_text_stl(std::string_view text, std::string_view name) {
  Facets made{.points = {}, .each_by_itself = true};
  SurfaceWords words(text, name);
  std::vector<Vec3> corners;
  bool is_first = true;
  bool in_facet = false;
  for (const auto* line = &words.next(); !line->empty(); line = &words.next()) {
    bool in_name = false;
    for (std::size_t i = 0; i < line->size(); ++i) {
      const std::string word = in_lower_case((*line)[i]);
      if (is_first && word != "solid") break;
      is_first = false;
      if (word == "facet") {
        in_facet = true;
        in_name = false;
      }
      in_name = in_name || word == "solid" || word == "endsolid";
      if (in_name) continue;
      if (word == "vertex") {
        corners.push_back(words.point(i + 1));
        i += 3;
      } else if (word == "endloop") {
        if (corners.size() != 3) words.fail("expected three corners, found " + std::to_string(corners.size()));
        add_triangle(made, {corners[0], corners[1], corners[2]});
        corners.clear();
        in_facet = false;
      }
    }
    if (is_first) break;
  }
  if (is_first) {
    refuse_file(name, "expected an STL file: text that starts with \"solid\", or 84 bytes and 50 for each facet");
  }
  if (in_facet || !corners.empty()) refuse_file(name, "truncated within a facet");
  return made;
}

Facets read_stl(std::string_view bytes, std::string_view name) {
  std::uint32_t count = 0;
  if (bytes.size() >= kStlHead) std::memcpy(&count, bytes.data() + kStlHead - sizeof count, sizeof count);
  const std::uint64_t expected = kStlHead + std::uint64_t{kStlFacet} * count;
  if (bytes.size() == expected) return read_binary_stl(bytes, name);
  if (bytes.find('\0') == std::string_view::npos) return read_text_stl(bytes, name);
  without_mark(bytes, name);  // UTF-16 also contains zero bytes
  const bool more = bytes.size() > expected;
  const std::uint64_t off = more ? bytes.size() - expected : expected - bytes.size();
  refuse_file(name, "the header of this binary STL file has " + std::to_string(count) + " facets, which require " +
                        std::to_string(expected) + " bytes; it has " + std::to_string(off) +
                        (more ? " too many" : " too few") +
                        (off % kStlFacet == 0 ? ", as many as " + std::to_string(off / kStlFacet) + " facets" : ""));
}

Facets read_obj(std::string_view text, std::string_view name) {
  Facets made;
  SurfaceWords words(text, name);
  for (const auto* line = &words.next_continued(); !line->empty(); line = &words.next_continued()) {
    if ((*line)[0] == "v") made.points.push_back(words.point(1));
    if ((*line)[0] != "f") continue;
    if (line->size() < 4) words.fail("expected three corners or more");
    for (std::size_t i = 1; i < line->size(); ++i) {
      const std::string_view word = (*line)[i];
      const long number = words.whole(word.substr(0, word.find('/')));
      const auto count = static_cast<long>(made.points.size());
      const long index = number < 0 ? count + number : number - 1;  // negative numbers count from the end
      if (index < 0 || index >= count) words.fail("there is no vertex " + std::string(word));
      made.corners.push_back(static_cast<int>(index));
    }
    made.ends.push_back(made.corners.size());
  }
  return made;
}

/// The first count may follow the keyword without a space.
void take_off_head(std::vector<std::string_view>& line, const SurfaceWords& words) {
  std::string_view word = line.front();
  const std::size_t off = word.find("OFF");
  const std::string_view extra = word.substr(0, std::min(off, word.size()));
  if (off == std::string_view::npos || (extra.find_first_not_of("STCN4n") != std::string_view::npos)) {
    words.fail("expected an OFF file, which starts with \"OFF\"");
  }
  if (extra.find_first_of("4n") != std::string_view::npos) {
    words.fail("expected points of three coordinates, found \"" + std::string(word) + '"');
  }
  word.remove_prefix(off + 3);
  if (word.empty()) {
    line.erase(line.begin());
  } else {
    line.front() = word;
  }
  if (!line.empty() && line.front() == "BINARY") words.fail("expected a text OFF file, found a binary file");
}

Facets read_off(std::string_view text, std::string_view name) {
  Facets made;
  SurfaceWords words(text, name);
  std::vector<std::string_view> head = words.next();
  if (head.empty()) refuse_file(name, "expected an OFF file, which starts with \"OFF\"");
  take_off_head(head, words);
  if (head.empty()) head = words.next();
  if (head.size() < 2) words.fail("expected the numbers of points and facets");
  const long points = words.whole(head[0]);
  const long facets = words.whole(head[1]);
  if (points < 0 || facets < 0) words.fail("expected numbers of points and facets that are not below 0");
  for (long i = 0; i < points; ++i) {
    if (words.next().empty()) {
      refuse_file(name, "truncated after " + std::to_string(i) + " points of " + std::to_string(points));
    }
    made.points.push_back(words.point(0));
  }
  for (long i = 0; i < facets; ++i) {
    const auto& line = words.next();
    if (line.empty()) {
      refuse_file(name, "truncated after " + std::to_string(i) + " facets of " + std::to_string(facets));
    }
    const long count = words.whole(line[0]);
    if (count < 3 || static_cast<std::size_t>(count) >= line.size()) words.fail("expected three corners or more");
    for (long c = 1; c <= count; ++c) {
      const long index = words.whole(line[static_cast<std::size_t>(c)]);
      if (index < 0 || index >= points) words.fail("there is no point " + std::to_string(index));
      made.corners.push_back(static_cast<int>(index));
    }
    made.ends.push_back(made.corners.size());
  }
  if (!words.next().empty()) words.fail("expected the end of the file after " + std::to_string(facets) + " facets");
  return made;
}

}  // namespace

Facets read_facets(std::string_view bytes, std::string_view ending, std::string_view name) {
  const std::string lower = in_lower_case(ending);
  if (lower == ".stl") return read_stl(bytes, name);
  if (lower == ".obj") return read_obj(bytes, name);
  if (lower == ".off") return read_off(bytes, name);
  refuse_file(name, "expected a surface: a file .stl, .obj or .off");
}

}  // namespace tendon::softbody
