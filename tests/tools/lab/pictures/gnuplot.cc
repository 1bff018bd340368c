// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/pictures/gnuplot.h"

#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

#include "tests/support/files.h"

namespace tendon::lab {
namespace {

/// Writing to a closed pipe then returns an error.
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

constexpr std::string_view kPngBegins = "\x89PNG";
constexpr std::string_view kSvgBegins = "<?xml";

/// Checks the end marker of an SVG or PNG file.
bool is_whole(const std::filesystem::path& path) {
  constexpr std::streamoff kTail = 32;
  std::ifstream picture(path, std::ios::binary | std::ios::ate);
  if (!picture) return false;
  const std::streamoff size = picture.tellg();
  std::string tail(static_cast<std::size_t>(std::min(size, kTail)), '\0');
  picture.seekg(size - static_cast<std::streamoff>(tail.size()));
  picture.read(tail.data(), static_cast<std::streamsize>(tail.size()));
  return picture && tail.find(path.extension() == ".svg" ? "</svg>" : "IEND") != std::string::npos;
}

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
         // An absolute path cannot begin with |, which would make gnuplot run a command.
         "\nset output " + literal(std::filesystem::absolute(path).string()) + "\n";
}

void check_picture_name(const std::filesystem::path& path) {
  if (path.extension() != ".svg" && path.extension() != ".png")
    throw std::invalid_argument(path.string() + ": expected a name that ends with .svg or .png");
  if (std::ranges::any_of(path.string(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }))
    throw std::invalid_argument("the file name of the picture contains control characters");
  expect_replaceable(path, {path.extension() == ".svg" ? kSvgBegins : kPngBegins});
}

void run_gnuplot(const std::string& script, const std::filesystem::path& path) {
  const IgnoreBrokenPipe ignore;
  // -d ignores ~/.gnuplot. Unlike standard input, a file makes gnuplot stop at the first error.
  std::FILE* const gnuplot =
      ::popen("command -v gnuplot >/dev/null || exit 127; exec gnuplot -d /dev/stdin >/dev/null", "w");
  if (gnuplot == nullptr) throw std::system_error(errno, std::generic_category(), "cannot start gnuplot");
  std::fwrite(script.data(), 1, script.size(), gnuplot);
  const int status = ::pclose(gnuplot);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    // gnuplot does not report a full disk.
    if (is_whole(path)) return;
    std::error_code ignored;
    if (std::filesystem::is_regular_file(path, ignored)) std::filesystem::remove(path, ignored);
    throw std::runtime_error("cannot write " + path.string() + ": the picture is truncated; is the disk full?");
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == 127)
    throw std::runtime_error("cannot draw " + path.string() + ": gnuplot is not installed (package gnuplot-nox)");
  throw std::runtime_error("cannot draw " + path.string() + ": gnuplot failed, see its messages above");
}

}  // namespace tendon::lab
