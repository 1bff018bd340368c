// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace tendon::dash {

/// One file of the page, as it was built and put into this program.
struct PageFile {
  std::string_view path;  ///< "/index.html"
  std::string_view type;  ///< Content-Type
  std::string_view bytes;
  std::string_view gzip;  ///< the same, compressed
};

/// All files of the page, from embed.cmake. In a build without Node it is one page that says what is missing.
std::span<const PageFile> page_files();

}  // namespace tendon::dash
