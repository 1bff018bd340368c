// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/sweep/submit.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "tests/tools/sweep/results.h"

namespace tendon::sweep {
namespace {

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char one : text) result += one == '\'' ? std::string("'\\''") : std::string(1, one);
  return result + "'";
}

std::vector<std::uint64_t> missing(const std::filesystem::path& folder, const Plan& plan) {
  std::vector<std::uint64_t> shards = status_of(folder, plan).missing;
  if (shards.empty()) throw std::invalid_argument("no shards are missing");
  return shards;
}

std::string name_of_job(const std::filesystem::path& folder) {
  std::string name = "tendon-" + std::filesystem::absolute(folder).lexically_normal().filename().string();
  if (name.ends_with('-')) name += "sweep";
  for (char& one : name) {
    const bool kept = (one >= 'a' && one <= 'z') || (one >= '0' && one <= '9');
    if (one >= 'A' && one <= 'Z') {
      one = static_cast<char>(one - 'A' + 'a');
    } else if (!kept) {
      one = '-';
    }
  }
  name.resize(std::min<std::size_t>(name.size(), 52));
  while (name.ends_with('-')) name.pop_back();
  return name;
}

}  // namespace

std::string slurm_job(const std::filesystem::path& folder, const Plan& plan, const std::filesystem::path& self,
                      const SlurmOptions& options) {
  if (options.most == 0) throw std::invalid_argument("--max-array 0: expected 1 or more");
  const std::vector<std::uint64_t> shards = missing(folder, plan);
  const std::string place = std::filesystem::absolute(folder).string();
  const bool by_number = shards.back() < options.most;
  const std::uint64_t tasks = std::min<std::uint64_t>(shards.size(), options.most);
  std::ostringstream job;
  job << "#!/bin/sh\n"
      << "# " << shards.size() << " of " << plan.shards() << " shards were missing when this was written.\n"
      << "#SBATCH --job-name=" << name_of_job(folder) << "\n"
      << "#SBATCH --array=" << (by_number ? ranges(shards) : "0-" + std::to_string(tasks - 1)) << "\n"
      << "#SBATCH --ntasks=1\n#SBATCH --cpus-per-task=1\n"
      << "#SBATCH --time=" << options.time << "\n"
      << "#SBATCH --output=" << place << "/slurm/%A_%a.out\n"
      << "#SBATCH --open-mode=append\n#SBATCH --requeue\n";
  if (!options.partition.empty()) job << "#SBATCH --partition=" << options.partition << "\n";
  job << "exec " << quoted(self.string()) << " run " << quoted(place);
  if (by_number) {
    job << " --shard \"$SLURM_ARRAY_TASK_ID\"\n";
  } else {
    job << " --task \"$SLURM_ARRAY_TASK_ID\" --of " << tasks << "\n";
  }
  return job.str();
}

std::string kubernetes_job(const std::filesystem::path& folder, const Plan& plan, const KubernetesOptions& options) {
  if (options.image.empty() || options.volume.empty()) {
    throw std::invalid_argument("--to kubernetes: expected --image IMAGE and --volume CLAIM");
  }
  const std::vector<std::uint64_t> shards = missing(folder, plan);
  const std::uint64_t pods = std::min<std::uint64_t>(shards.size(), 10000);
  const std::string place = std::filesystem::absolute(folder).string();
  std::ostringstream job;
  job << "apiVersion: batch/v1\n"
         "kind: Job\n"
         "metadata:\n"
      << "  name: " << name_of_job(folder) << "\n"
      << "spec:\n"
         "  completionMode: Indexed\n"
      << "  completions: " << pods << "\n"
      << "  parallelism: " << std::min(pods, options.parallel) << "\n"
      << "  backoffLimitPerIndex: 3\n"
         "  podReplacementPolicy: Failed\n"
         "  podFailurePolicy:\n"
         "    rules:\n"
         "      - action: Ignore  # draining a node is not an error of the shard\n"
         "        onPodConditions:\n"
         "          - type: DisruptionTarget\n"
         "            status: \"True\"\n"
         "      - action: FailIndex  # repeating cannot help with wrong usage\n"
         "        onExitCodes:\n"
         "          operator: In\n"
         "          values: [2]\n"
         "  template:\n"
         "    spec:\n"
         "      restartPolicy: Never\n"
         "      containers:\n"
         "        - name: sweep\n"
      << "          image: " << options.image << "\n"
      << "          command: [tendon-sweep, run, \"" << place << "\", --task, $(JOB_COMPLETION_INDEX), --of, \"" << pods
      << "\"]\n"
         "          env:\n"
         "            - name: JOB_COMPLETION_INDEX\n"
         "              valueFrom:\n"
         "                fieldRef:\n"
         "                  fieldPath: metadata.annotations['batch.kubernetes.io/job-completion-index']\n"
         "          resources:\n"
         "            requests: {cpu: \"1\", memory: 256Mi}\n"
         "            limits: {cpu: \"1\", memory: 256Mi}\n"
         "          volumeMounts:\n"
         "            - name: sweep\n"
      << "              mountPath: " << place << "\n"
      << "      volumes:\n"
         "        - name: sweep\n"
         "          persistentVolumeClaim:\n"
      << "            claimName: " << options.volume << "\n";
  return job.str();
}

}  // namespace tendon::sweep
