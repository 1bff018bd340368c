// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/discovery/discovery.h"

namespace tendon::dns_sd {

std::vector<Found> resolve(const Instance& instance) {
  return instance.domain == kLocal ? resolve_by_avahi(instance) : resolve_by_dns(instance);
}

std::vector<Found> browse(const std::string& domain) {
  return domain == kLocal ? browse_by_avahi() : browse_by_dns(domain);
}

}  // namespace tendon::dns_sd
