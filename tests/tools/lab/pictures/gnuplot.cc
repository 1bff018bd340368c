// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/gnuplot.h"

#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <stdexcept>
#include <system_error>

namespace tendon::lab {
namespace {

/// While it lives, writing to a process that has ended is an error and not our end.
class IgnoreBrokenPipe {
 public:
  IgnoreBrokenPipe() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    ::sigaction(SIGPIPE, &ignore, &before_);
  }
  ~IgnoreBrokenPipe() { ::sigaction(SIGPIPE, &before_, nullptr); }
  IgnoreBrokenPipe(const IgnoreBrokenPipe&) = delete;
  IgnoreBrokenPipe& operator=(const IgnoreBrokenPipe&) = delete;

 private:
  struct sigaction before_ {};
};

}  // namespace

std::string literal(std::string_view text) {
  std::string result = "'";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    result += byte < 0x20 || byte == 0x7F ? ' ' : c;
    if (c == '\'') result += '\'';
  }
  return result + "'";
}

std::string begin_picture(const std::filesystem::path& path, int width, int height) {
  const std::string size = std::to_string(width) + "," + std::to_string(height);
  return "set encoding utf8\nset terminal " +
         (path.extension() == ".svg" ? "svg size " + size + " font 'sans-serif,15' background '#ffffff'"
                                     : "pngcairo size " + size + " font 'sans,11.5'") +
         // Absolute, so that no name begins with the | after which gnuplot takes a command.
         "\nset output " + literal(std::filesystem::absolute(path).string()) + "\n";
}

void check_picture_name(const std::filesystem::path& path) {
  if (path.extension() != ".svg" && path.extension() != ".png")
    throw std::invalid_argument(path.string() + ": expected a name that ends with .svg or .png");
  if (std::ranges::any_of(path.string(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }))
    throw std::invalid_argument("the name of the picture has control characters in it");
}

void run_gnuplot(const std::string& script, const std::filesystem::path& path) {
  const IgnoreBrokenPipe ignore;
  // -d: whatever the user has in ~/.gnuplot, the picture is the same. A script that is a file ends at its first error;
  // one that is typed in goes on.
  std::FILE* const gnuplot =
      ::popen("command -v gnuplot >/dev/null || exit 127; exec gnuplot -d /dev/stdin >/dev/null", "w");
  if (gnuplot == nullptr) throw std::system_error(errno, std::generic_category(), "cannot start gnuplot");
  // A gnuplot that ends early shows in its status.
  std::fwrite(script.data(), 1, script.size(), gnuplot);
  const int status = ::pclose(gnuplot);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return;
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127)
    throw std::runtime_error("cannot draw " + path.string() + ": gnuplot is not installed (package gnuplot-nox)");
  throw std::runtime_error("cannot draw " + path.string() + ": gnuplot failed; what it says is above");
}

}  // namespace tendon::lab
