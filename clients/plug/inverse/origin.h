// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace tendon::plug {

/// Whether a page from `origin` ("https://lab.example", a browser's header) may come in: it is of this machine, over
/// http or https and by any port (localhost, a name below it, 127.0.0.0/8, [::1]), or it is one of `allowed`, letter
/// by letter. "null", the origin of a page that was opened as a file, is not unless it is allowed.
///
/// Thread-safe, realtime-safe: yes.
bool may_come_from(std::string_view origin, std::span<const std::string> allowed);

}  // namespace tendon::plug
