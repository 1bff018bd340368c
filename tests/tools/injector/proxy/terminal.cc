// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <iostream>
#include <utility>
#include <vector>

namespace tendon::injector {
namespace {

winsize size_of_terminal() {
  winsize size{};
  if (::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0 || size.ws_row == 0) {
    size.ws_col = 80;
    size.ws_row = 24;
  }
  return size;
}

}  // namespace

std::unique_ptr<Terminal> Terminal::take() {
  // A background process that configures the terminal would be stopped (SIGTTOU).
  if (::isatty(STDIN_FILENO) != 1 || ::isatty(STDOUT_FILENO) != 1 || ::tcgetpgrp(STDIN_FILENO) != ::getpgrp()) {
    return nullptr;
  }
  termios before{};
  if (::tcgetattr(STDIN_FILENO, &before) != 0) return nullptr;
  termios raw = before;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  if (::tcsetattr(STDIN_FILENO, TCSANOW, &raw) != 0) return nullptr;
  return std::unique_ptr<Terminal>(new Terminal(before));
}

Terminal::~Terminal() {
  ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  if (drawn_ > 0) std::cout << std::endl;
}

std::size_t Terminal::columns() const { return size_of_terminal().ws_col; }

void Terminal::draw(std::string_view lines) {
  std::vector<std::string_view> all;
  while (true) {
    const std::size_t end = lines.find('\n');
    all.push_back(lines.substr(0, end));
    if (end == std::string_view::npos) break;
    lines.remove_prefix(end + 1);
  }
  const std::size_t rows = size_of_terminal().ws_row;
  if (all.size() > rows) all.erase(all.begin() + static_cast<std::ptrdiff_t>(rows) - 1, all.end() - 1);

  // Moves to the first line of the previous picture. Each new line clears the rest of the old one.
  std::string text;
  if (drawn_ > 1) text += "\033[" + std::to_string(std::min(drawn_, rows) - 1) + "A";
  text += '\r';
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i > 0) text += "\r\n";
    text += all[i];
    text += "\033[K";
  }
  text += "\033[J";
  drawn_ = all.size();
  std::cout << text << std::flush;
}

int Terminal::fd() { return STDIN_FILENO; }

std::optional<std::string> Terminal::next_line() {
  std::array<char, 256> piece;
  for (ssize_t got = 0; (got = ::read(STDIN_FILENO, piece.data(), piece.size())) > 0;) {
    unread_.append(piece.data(), static_cast<std::size_t>(got));
  }
  while (!unread_.empty()) {
    const char c = unread_.front();
    unread_.erase(0, 1);
    if (c == '\n' || c == '\r') return std::exchange(typed_, {});
    if (c == '\b' || c == '\x7f') {
      while (!typed_.empty() && (static_cast<unsigned char>(typed_.back()) & 0xc0) == 0x80) typed_.pop_back();
      if (!typed_.empty()) typed_.pop_back();
    } else if (c == '\x15') {  // ^U
      typed_.clear();
    } else if (static_cast<unsigned char>(c) >= 0x20) {
      typed_ += c;
    }
  }
  return std::nullopt;
}

}  // namespace tendon::injector
