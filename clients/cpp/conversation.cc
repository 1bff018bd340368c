// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/conversation.h"

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
constexpr std::size_t kStateWords = 19;
constexpr std::size_t kForceWords = 3;
constexpr std::size_t kStiffnessWords = 9;

/// One line, as it grows.
class Line {
 public:
  void add(double value) {
    if (std::isnan(value)) return add(std::string_view("nan"));  // whatever its bits are
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
  const std::string& text() const { return text_; }

 private:
  void add(std::string_view word) {
    if (!text_.empty()) text_ += ' ';
    text_ += word;
  }
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
  if (touch.stiffness) line.add_all(*touch.stiffness);
}

std::string text_of(const Touch& touch) {
  Line line;
  add_touch(line, touch);
  return line.text();
}

/// The words of one line, taken one after another.
class Words {
 public:
  Words(std::uint64_t line, const std::string& text) : line_(line) {
    std::istringstream stream(text);
    for (std::string word; stream >> word;) words_.push_back(word);
    const std::size_t answer = words_.size() - std::min(words_.size(), kStateWords);
    if (answer != kForceWords && answer != kForceWords + kStiffnessWords) {
      fail("expected " + std::to_string(kStateWords + kForceWords) + " or " +
           std::to_string(kStateWords + kForceWords + kStiffnessWords) + " words, got " +
           std::to_string(words_.size()));
    }
  }

  template <typename Number>
  void take(Number& value) {
    const std::string& word = words_[next_++];
    const char* const end = word.data() + word.size();
    std::from_chars_result result{};
    if constexpr (std::is_floating_point_v<Number>) {
      result = std::from_chars(word.data(), end, value, std::chars_format::hex);
    } else {
      result = std::from_chars(word.data(), end, value);
    }
    if (result.ec != std::errc{} || result.ptr != end) fail("\"" + word + "\" is no number of its kind");
  }
  template <typename Matrix>
  void take_all(Matrix& values) {
    for (int row = 0; row < values.rows(); ++row)
      for (int col = 0; col < values.cols(); ++col) take(values(row, col));
  }
  bool more() const { return next_ < words_.size(); }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error("line " + std::to_string(line_) + ": " + what);
  }
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
  if (words.more()) words.take_all(touch.stiffness.emplace());
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
    if (from.eof()) throw std::runtime_error("line " + std::to_string(line) + ": it is cut off");
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
  if (first->was.force == first->is.force) out << "; the stiffness differs";
  return out.str();
}

}  // namespace tendon
