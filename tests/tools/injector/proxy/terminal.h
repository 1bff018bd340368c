// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <termios.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace tendon::injector {

/// The terminal that this program was started from: a picture that is drawn again in place, and a line that the user
/// types meanwhile, which the picture shows. ^C, ^Z and the like work as ever.
///
/// Thread-safe: no.
class Terminal {
 public:
  /// Null when standard input and output are not both the terminal in whose foreground we run.
  static std::unique_ptr<Terminal> take();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  /// Leaves the last picture standing, and gives the terminal back as it was.
  ~Terminal();

  std::size_t columns() const;

  /// Draws `lines` over those of the call before. They must not be wider than columns(); those that do not fit above
  /// the bottom of the terminal are left out from the middle of the bottom up, the last one stays.
  void draw(std::string_view lines);

  /// For poll(2).
  static int fd();
  /// Takes what the user has typed, never waits; a whole line when there is one.
  std::optional<std::string> next_line();
  /// Of a line that is not complete.
  const std::string& typed() const noexcept { return typed_; }

 private:
  explicit Terminal(const termios& before) : before_(before) {}

  termios before_;
  std::size_t drawn_ = 0;  // lines
  std::string typed_;
  std::string unread_;
};

}  // namespace tendon::injector
