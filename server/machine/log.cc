// SPDX-License-Identifier: Apache-2.0
#include "server/machine/log.h"

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

namespace tendon::log {

namespace {

spdlog::logger& logger() {
  static const auto made = [] {
    auto log = std::make_unique<spdlog::logger>("tendond", std::make_unique<spdlog::sinks::stderr_color_sink_mt>());
    log->set_pattern("%H:%M:%S.%e %^%l%$ %v");
    return log;
  }();
  return *made;
}

}  // namespace

void info(std::string_view text) { logger().info("{}", text); }
void warn(std::string_view text) { logger().warn("{}", text); }
void error(std::string_view text) { logger().error("{}", text); }

}  // namespace tendon::log
