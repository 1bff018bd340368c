// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/conversation.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <istream>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace tendon {
namespace {

constexpr std::string_view kHeader = "tendon conversation 1";

constexpr std::string_view kStiffness = "stiffness";
constexpr std::string_view kRadius = "radius";
constexpr std::string_view kContact = "contact";
constexpr std::string_view kTable = "table";
constexpr std::string_view kCut = "cut";
constexpr std::string_view kError = "error";

class Line {
 public:
  void add(double value) {
    if (std::isnan(value)) return add(std::string_view("nan"));  // regardless of its sign and payload
    std::array<char, 64> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::hex).ptr;
    add(std::string_view(text.data(), static_cast<std::size_t>(end - text.data())));
  }
  template <std::integral Integer>
  void add(Integer value) {
    add(std::string_view(std::to_string(value)));
  }
  template <typename Matrix>
  void add_all(const Matrix& values) {
    for (int row = 0; row < values.rows(); ++row)
      for (int col = 0; col < values.cols(); ++col) add(values(row, col));
  }
  void add(std::string_view word) {
    if (!text_.empty()) text_ += ' ';
    text_ += word;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

void add_state(Line& line, const DeviceState& hand) {
  line.add(hand.tick);
  line.add(hand.sampled.time_since_epoch().count());
  line.add_all(hand.position);
  line.add_all(hand.velocity);
  line.add_all(hand.force_applied);
  line.add(hand.energy);
  line.add(hand.permitted_force);
  line.add(hand.reasons);
  line.add(hand.force_sequence);
  line.add(hand.force_age.count());
  line.add(static_cast<unsigned>(hand.mode));
  line.add(hand.device);
  line.add(hand.channel);
}

void add_touch(Line& line, const Touch& touch) {
  line.add_all(touch.force);
  if (touch.stiffness) {
    line.add(kStiffness);
    line.add_all(*touch.stiffness);
  }
  if (touch.valid_radius != Touch{}.valid_radius) {
    line.add(kRadius);
    line.add(touch.valid_radius);
  }
  if (touch.contact) {
    line.add(kContact);
    line.add_all(touch.contact->normal);
    line.add(touch.contact->gap);
    if (const auto& table = touch.contact->table) {
      line.add(kTable);
      line.add(table->first);
      line.add(table->step);
      const std::uint32_t size = std::min<std::uint32_t>(table->size, ForceTable::kMaxEntries);
      line.add(size);
      for (std::uint32_t i = 0; i < size; ++i) line.add(table->force[i]);
    }
  }
  if (touch.topology_changed) line.add(kCut);
  if (touch.error) {
    line.add(kError);
    line.add(*touch.error);
  }
}

std::string text_of(const Touch& touch) {
  Line line;
  add_touch(line, touch);
  return line.text();
}

class Words {
 public:
  Words(std::uint64_t line, const std::string& text) : line_(line) {
    std::istringstream stream(text);
    for (std::string word; stream >> word;) words_.push_back(word);
  }

  bool take_word(std::string_view word) {
    if (!more() || words_[next_] != word) return false;
    ++next_;
    return true;
  }

  template <typename Number>
  void take(Number& value) {
    if (!more()) fail("it ends after " + std::to_string(words_.size()) + " words");
    const std::string& word = words_[next_++];
    const char* const end = word.data() + word.size();
    std::from_chars_result result{};
    if constexpr (std::is_floating_point_v<Number>) {
      result = std::from_chars(word.data(), end, value, std::chars_format::hex);
    } else {
      result = std::from_chars(word.data(), end, value);
    }
    if (result.ec != std::errc{} || result.ptr != end) fail("\"" + word + "\" is not a valid number");
  }
  template <typename Matrix>
  void take_all(Matrix& values) {
    for (int row = 0; row < values.rows(); ++row)
      for (int col = 0; col < values.cols(); ++col) take(values(row, col));
  }
  void expect_no_more() const {
    if (more()) fail("\"" + words_[next_] + "\" is not expected in an answer here");
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error("line " + std::to_string(line_) + ": " + what);
  }

 private:
  bool more() const { return next_ < words_.size(); }

  std::uint64_t line_;
  std::vector<std::string> words_;
  std::size_t next_ = 0;
};

DeviceState take_state(Words& words) {
  DeviceState hand;
  Duration::rep sampled = 0;
  Duration::rep age = 0;
  std::uint8_t mode = 0;
  words.take(hand.tick);
  words.take(sampled);
  words.take_all(hand.position);
  words.take_all(hand.velocity);
  words.take_all(hand.force_applied);
  words.take(hand.energy);
  words.take(hand.permitted_force);
  words.take(hand.reasons);
  words.take(hand.force_sequence);
  words.take(age);
  words.take(mode);
  words.take(hand.device);
  words.take(hand.channel);
  hand.sampled = PeerTime(Duration(sampled));
  hand.force_age = Duration(age);
  hand.mode = static_cast<Mode>(mode);
  return hand;
}

Touch take_touch(Words& words) {
  Touch touch;
  words.take_all(touch.force);
  if (words.take_word(kStiffness)) words.take_all(touch.stiffness.emplace());
  if (words.take_word(kRadius)) words.take(touch.valid_radius);
  if (words.take_word(kContact)) {
    Contact& contact = touch.contact.emplace();
    words.take_all(contact.normal);
    words.take(contact.gap);
    if (words.take_word(kTable)) {
      ForceTable& table = contact.table.emplace();
      words.take(table.first);
      words.take(table.step);
      words.take(table.size);
      if (table.size > ForceTable::kMaxEntries) {
        words.fail("expected a table of at most " + std::to_string(ForceTable::kMaxEntries) + " entries, got " +
                   std::to_string(table.size));
      }
      for (std::uint32_t i = 0; i < table.size; ++i) words.take(table.force[i]);
    }
  }
  touch.topology_changed = words.take_word(kCut);
  if (words.take_word(kError)) words.take(touch.error.emplace());
  words.expect_no_more();
  return touch;
}

}  // namespace

Physics recorded(Physics engine, std::ostream& to) {
  to << kHeader << '\n';
  return [engine = std::move(engine), &to](const DeviceState& hand) {
    Touch touch = engine(hand);
    Line line;
    add_state(line, hand);
    add_touch(line, touch);
    to << line.text() << '\n';
    return touch;
  };
}

Replay replay(std::istream& from, const Physics& engine) {
  std::string text;
  if (!std::getline(from, text) || text != kHeader) {
    throw std::runtime_error("line 1: expected \"" + std::string(kHeader) + "\", got \"" + text + '"');
  }
  Replay found;
  for (std::uint64_t line = 2; std::getline(from, text); ++line) {
    Words words(line, text);
    if (from.eof()) throw std::runtime_error("line " + std::to_string(line) + ": truncated");
    const DeviceState hand = take_state(words);
    const Touch was = take_touch(words);
    const Touch is = engine(hand);
    ++found.answers;
    if (text_of(was) == text_of(is)) continue;
    ++found.differing;
    const double apart = (is.force - was.force).norm();
    if (std::isfinite(apart)) found.largest_n = std::max(found.largest_n, apart);
    if (!found.first) found.first = Replay::Difference{line, hand.tick, was, is};
  }
  return found;
}

std::string Replay::text() const {
  std::ostringstream out;
  out << answers << " answers, ";
  if (!first) {
    out << "all the same";
    return out.str();
  }
  const auto vector = [&](const Vec3& v) { out << '(' << v.x() << ", " << v.y() << ", " << v.z() << ") N"; };
  out << differing << " differ, by up to " << largest_n << " N; first in line " << first->line << ", tick "
      << first->tick << ": it was ";
  vector(first->was.force);
  out << " and is ";
  vector(first->is.force);
  if (first->was.force == first->is.force) out << "; only the rest of the answer differs";
  return out.str();
}

}  // namespace tendon
