// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/discovery/list.h"

#include <algorithm>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "clients/cpp/discovery/discovery.h"
#include "protocol/wire/text.h"

namespace tendon {
namespace {

std::string in_json(const dns_sd::Found& found, const std::string& name) {
  const nlohmann::ordered_json json = {{"server", name},
                                       {"device", found.about.device},
                                       {"hz", found.about.hz},
                                       {"suite", found.about.suite},
                                       {"channels", found.about.channels},
                                       {"version", found.about.version},
                                       {"host", found.host},
                                       {"port", found.port}};
  return json.dump();
}

std::string in_words(const dns_sd::Found& found) {
  std::string text;
  const auto add = [&text](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
  if (!found.about.device.empty()) add(found.about.device);
  if (found.about.hz != 0) add(std::to_string(found.about.hz) + " Hz");
  std::string channels;
  for (const std::string& channel : found.about.channels) channels += " " + channel;
  if (!channels.empty()) add((found.about.channels.size() == 1 ? "channel" : "channels") + channels);
  if (!found.host.empty()) add("at " + found.host + ":" + std::to_string(found.port));
  return text;
}

}  // namespace

std::optional<int> list_servers(const ServerName& server, bool json) {
  if (!server.instance() || !server.instance()->name.empty()) return std::nullopt;
  try {
    const std::vector<dns_sd::Found> all = dns_sd::browse(server.instance()->domain);
    std::size_t width = 0;
    const auto name = [](const dns_sd::Found& found) { return "dns-sd:" + to_string(found.instance); };
    for (const dns_sd::Found& found : all) width = std::max(width, name(found).size());
    for (const dns_sd::Found& found : all) {
      const std::string words = in_words(found);
      std::string line = json ? in_json(found, name(found)) : name(found);
      if (!json && !words.empty()) line += std::string(width + 2 - line.size(), ' ') + visible(words);
      std::cout << line << '\n';
    }
    std::cout.flush();
    if (all.empty()) std::cerr << "no reply for " << full_name(*server.instance()) << '\n';
    return 0;
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
}

}  // namespace tendon
