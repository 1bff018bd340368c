// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <termios.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace tendon::injector {

/// A picture that is redrawn in place, with the line that the user is typing. ^C and ^Z keep their function.
///
/// Thread-safe: no.
class Terminal {
 public:
  /// Returns null unless standard input and output are the terminal and this process is in its foreground.
  static std::unique_ptr<Terminal> take();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;
  ~Terminal();

  std::size_t columns() const;

  /// Lines must not exceed columns(). If they do not fit on the screen, lines above the last one are omitted.
  void draw(std::string_view lines);

  static int fd();
  /// Never blocks.
  std::optional<std::string> next_line();
  const std::string& typed() const noexcept { return typed_; }

 private:
  explicit Terminal(const termios& before) : before_(before) {}

  termios before_;
  std::size_t drawn_ = 0;  // lines
  std::string typed_;
  std::string unread_;
};

}  // namespace tendon::injector
