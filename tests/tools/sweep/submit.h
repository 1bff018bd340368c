// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/tools/sweep/plan.h"

namespace tendon::sweep {

struct SlurmOptions {
  std::string partition{};        ///< empty: the site's default
  std::string time = "01:00:00";  ///< of a task
  std::uint64_t most = 1000;      ///< tasks in an array: a site's MaxArraySize less 1
};
/// Returns a job array for sbatch that runs the missing shards. If there are more than `most` shards, its tasks take
/// every Nth shard. Throws std::invalid_argument if every
/// shard has a result.
std::string slurm_job(const std::filesystem::path& folder, const Plan& plan, const std::filesystem::path& self,
                      const SlurmOptions& options);

struct KubernetesOptions {
  std::string image;            ///< has the plan's program at the same path, and tendon-sweep
  std::string volume;           ///< claim that holds the sweep's folder
  std::uint64_t parallel = 64;  ///< pods at a time
};
/// An Indexed Job (Kubernetes 1.33 or later: backoffLimitPerIndex) that runs what is missing, as YAML for kubectl apply.
std::string kubernetes_job(const std::filesystem::path& folder, const Plan& plan, const KubernetesOptions& options);

}  // namespace tendon::sweep
