// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/file_text.h"

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <system_error>

namespace tendon::softbody {

std::string read_file(const std::filesystem::path& file, std::uintmax_t most) {
  const auto refuse = [&](const std::string& why) {
    throw std::invalid_argument("cannot read " + file.string() + why);
  };
  std::error_code error;
  const auto kind = std::filesystem::status(file, error).type();
  if (kind == std::filesystem::file_type::not_found) refuse(": no such file");
  if (kind == std::filesystem::file_type::directory) refuse(": it is a folder");
  if (!error && kind != std::filesystem::file_type::regular) refuse(": it is not a regular file");
  const auto bytes = std::filesystem::file_size(file, error);
  if (error) refuse(": " + error.message());
  if (bytes > most) refuse(": it has more than " + std::to_string(most / 1024) + " KiB");
  std::ifstream stream(file, std::ios::binary);
  std::string text((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  if (!stream) refuse("");
  return text;
}

void refuse_file(std::string_view name, const std::string& what) {
  throw std::invalid_argument(std::string(name) + ": " + what);
}

std::string_view without_mark(std::string_view text, std::string_view name) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) refuse_file(name, "is UTF-16; save it as UTF-8");
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return text;
}

}  // namespace tendon::softbody
