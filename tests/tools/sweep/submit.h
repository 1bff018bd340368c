// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/tools/sweep/plan.h"

namespace tendon::sweep {

struct SlurmOptions {
  std::string partition{};        ///< empty: the cluster's default
  std::string time = "01:00:00";  ///< time limit of a task
  std::uint64_t most = 1000;      ///< maximum number of tasks in an array, which is MaxArraySize of the cluster minus 1
};
/// Returns a job array for sbatch that runs the missing shards. If there are more than `most` shards, its tasks take
/// every Nth shard. Throws std::invalid_argument if every shard has a result.
std::string slurm_job(const std::filesystem::path& folder, const Plan& plan, const std::filesystem::path& self,
                      const SlurmOptions& options);

struct KubernetesOptions {
  std::string image;            ///< contains tendon-sweep, and the plan's program at the same path
  std::string volume;           ///< claim of the volume with the sweep's folder
  std::uint64_t parallel = 64;  ///< maximum number of pods at a time
};
/// YAML for kubectl apply. Requires Kubernetes 1.33 (backoffLimitPerIndex).
std::string kubernetes_job(const std::filesystem::path& folder, const Plan& plan, const KubernetesOptions& options);

}  // namespace tendon::sweep
