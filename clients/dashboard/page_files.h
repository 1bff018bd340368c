// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace tendon::dash {

struct PageFile {
  std::string_view path;  ///< "/index.html"
  std::string_view type;  ///< Content-Type
  std::string_view bytes;
  std::string_view gzip;  ///< compressed `bytes`
};

/// Returns all files of the page, from embed.cmake. Builds without Node contain a single page that reports this.
std::span<const PageFile> page_files();

}  // namespace tendon::dash
