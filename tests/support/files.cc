// SPDX-License-Identifier: Apache-2.0
#include "tests/support/files.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

namespace tendon {
namespace {

namespace fs = std::filesystem;

std::string kind_of(fs::file_type type) {
  switch (type) {
    case fs::file_type::directory:
      return "a folder";
    case fs::file_type::fifo:
      return "a pipe";
    case fs::file_type::socket:
      return "a socket";
    case fs::file_type::character:
    case fs::file_type::block:
      return "a device";
    default:
      return "something else";
  }
}

}  // namespace

void expect_replaceable(const fs::path& file, std::initializer_list<std::string_view> beginnings) {
  std::error_code none;
  const fs::file_type type = fs::status(file, none).type();
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, none)) {
    throw std::runtime_error("cannot write " + file.string() + ": there is no folder " + folder.string());
  }
  if (type == fs::file_type::not_found || type == fs::file_type::none) return;
  if (file == "/dev/null" || file == "/dev/stdout") return;
  if (type != fs::file_type::regular) {
    throw std::runtime_error("cannot write " + file.string() + ": it is " + kind_of(type));
  }
  std::string begin(64, '\0');
  std::ifstream stream(file, std::ios::binary);
  stream.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(stream.gcount()));
  if (begin.empty() ||
      std::ranges::any_of(beginnings, [&](std::string_view one) { return begin.starts_with(one.substr(0, 64)); })) {
    return;
  }
  throw std::runtime_error("cannot write " + file.string() +
                           ": a file of another kind is there, which would be lost; move it or take another name");
}

}  // namespace tendon
