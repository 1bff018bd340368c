// SPDX-License-Identifier: Apache-2.0
//
// The checks of deploy/kubernetes/check: types, misspelled keys, the rules of README.md, and references to programs and
// files. Prints a line for each error and a summary.
import { execFileSync } from "node:child_process";
import { copyFileSync, existsSync, mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join, relative } from "node:path";
import { fileURLToPath } from "node:url";
import { parseAllDocuments } from "yaml";

const here = dirname(fileURLToPath(import.meta.url));
const [, , folder = here, programs = ""] = process.argv;
const faults = [];
const fault = (file, what) => faults.push(`${relative(folder, file)}: ${what}`);

// ---- Reading ---------------------------------------------------------------------------------------------------------

const read = (file) => {
  const documents = parseAllDocuments(readFileSync(file, "utf8"), { uniqueKeys: true });
  for (const document of documents) for (const error of document.errors) fault(file, error.message.split("\n")[0]);
  return documents.map((document) => document.toJS()).filter((value) => value !== null);
};

const kustomizations = [];
const find = (place) => {
  for (const entry of readdirSync(place, { withFileTypes: true })) {
    if (entry.name === "node_modules") continue;
    const path = join(place, entry.name);
    if (entry.isDirectory()) find(path);
    else if (entry.name === "kustomization.yaml") kustomizations.push(path);
  }
};
find(folder);

/** {file, value, patch} of each document in the kustomizations. */
const documents = [];
const known = ["apiVersion", "kind", "namespace", "resources", "images", "patches", "configMapGenerator"];
for (const file of kustomizations) {
  const [value] = read(file);
  for (const key of Object.keys(value)) if (!known.includes(key)) fault(file, `unknown key ${key}`);
  const named = (name, patch) => {
    const path = join(dirname(file), name);
    if (!existsSync(path)) return fault(file, `${name} does not exist`);
    if (existsSync(join(path, "kustomization.yaml"))) return;
    for (const one of read(path)) documents.push({ file: path, value: one, patch });
  };
  for (const name of value.resources ?? []) named(name, false);
  for (const { path } of value.patches ?? []) named(path, true);
  for (const { files = [] } of value.configMapGenerator ?? []) {
    for (const name of files) if (!existsSync(join(dirname(file), name))) fault(file, `${name} does not exist`);
  }
}
// The job of a sweep, which is created by tendon-sweep.
if (programs !== "" && existsSync(join(programs, "tendon-sweep"))) {
  const sweep = mkdtempSync(join(tmpdir(), "tendon-check-"));
  const say = (...words) => execFileSync(join(programs, "tendon-sweep"), words, { encoding: "utf8" });
  say("plan", sweep, "--units", "1:10", "--per-shard", "2", "--", "tendon-worlds", "run");
  const [job] = parseAllDocuments(say("submit", sweep, "--to", "kubernetes", "--image", "tendon", "--volume", "sweep"));
  documents.push({ file: join(folder, "tendon-sweep submit --to kubernetes"), value: job.toJS(), patch: false });
  rmSync(sweep, { recursive: true });
}
const whole = documents.filter((document) => !document.patch);
const find_one = (kind, name) => whole.find((d) => d.value.kind === kind && d.value.metadata?.name === name)?.value;
for (const { file, value, patch } of documents) {
  if (patch && !find_one(value.kind, value.metadata?.name)) {
    fault(file, `changes ${value.kind} ${value.metadata?.name}, which is not in the base`);
  }
}

// ---- Types: TypeScript finds unknown keys with the published types of Kubernetes ------------------------------------

const partial = "type Part<T> = T extends object ? { [K in keyof T]?: Part<T[K]> } : T;\n";
const modules = {
  ...Object.fromEntries(["apps/v1", "policy/v1", "scheduling.k8s.io/v1", "batch/v1", "v1"].map((name) => [name, `kubernetes-models/${name}`])),
  "agones.dev/v1": "./agones",
};
const work = mkdtempSync(join(here, "node_modules", ".check-"));
try {
  documents.forEach(({ file, value, patch }, index) => {
    const module = modules[value.apiVersion];
    if (module === undefined) return fault(file, `apiVersion ${value.apiVersion}: expected one of ${Object.keys(modules)}`);
    const type = `I${value.kind}`;
    writeFileSync(
      join(work, `d${index}.ts`),
      `import type { ${type} } from "${module}";\n${partial}` +
        `const d: ${patch ? `Part<${type}>` : type} = ${JSON.stringify(value, null, 1)};\nexport default d;\n`,
    );
  });
  copyFileSync(join(here, "agones.ts"), join(work, "agones.ts"));
  const tsc = join(here, "node_modules", "typescript", "bin", "tsc");
  const options = ["--noEmit", "--strict", "--skipLibCheck", "--moduleResolution", "bundler", "--module", "esnext"];
  const sources = readdirSync(work).map((name) => join(work, name));
  try {
    execFileSync(process.execPath, [tsc, ...options, ...sources], { encoding: "utf8", stdio: "pipe" });
  } catch (error) {
    for (const line of error.stdout.split("\n")) {
      const found = /d(\d+)\.ts\((\d+),\d+\): error \w+: (.*)/.exec(line);
      if (!found) continue;
      const where = readFileSync(join(work, `d${found[1]}.ts`), "utf8").split("\n")[found[2] - 1].trim();
      fault(documents[found[1]].file, `${found[3]} At: ${where}`);
    }
  }
  for (const { file, value, patch } of documents) {
    if (patch || !modules[value.apiVersion]?.startsWith("kubernetes-models")) continue;
    const models = await import(modules[value.apiVersion]);
    try {
      new models[value.kind](value).validate();
    } catch (error) {
      fault(file, `${value.kind}: ${error.message}`);
    }
  }
} finally {
  rmSync(work, { recursive: true });
}

// ---- The rules of README.md ----------------------------------------------------------------------------------------

const rule = (name, holds) => {
  let kept = false;
  try {
    kept = holds();
  } catch {
    // An object that is needed by the rule does not exist.
  }
  if (!kept) faults.push(`rule: ${name}`);
};
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
const server = find_one("DaemonSet", "server");
const engines = whole.filter((d) => d.value.kind === "Deployment").map((d) => d.value);
const pod = server?.spec?.template?.spec ?? {};
const all_of = (spec) => [...(spec?.initContainers ?? []), ...(spec?.containers ?? [])];
const everywhere = [pod, ...engines.map((engine) => engine.spec?.template?.spec)].flatMap(all_of);
const one = (name) => all_of(pod).find((container) => container.name === name);

rule("the server uses the network of its node", () => pod.hostNetwork === true && pod.dnsPolicy === "ClusterFirstWithHostNet");
rule("no container uses hostPort", () => !JSON.stringify(documents).includes('"hostPort"'));
rule("there is no Service", () => whole.every((d) => d.value.kind !== "Service"));
rule("requests are equal to limits and are whole cores, also in patches", () =>
  everywhere.every((c) => c.resources) &&
  documents.flatMap((d) => all_of(d.value.spec?.template?.spec)).filter((c) => c.resources).every((c) =>
    same(c.resources.requests, c.resources.limits) && /^[1-9]\d*$/.test(c.resources.limits.cpu) && c.resources.limits.memory));
rule("the server only has the capabilities SYS_NICE and IPC_LOCK", () =>
  ["doctor", "tendond"].every((name) => same(one(name).securityContext.capabilities, { drop: ["ALL"], add: ["SYS_NICE", "IPC_LOCK"] })));
rule("the other containers have no capabilities and are not root", () =>
  everywhere.filter((c) => !["doctor", "tendond"].includes(c.name)).every((c) => same(c.securityContext.capabilities, { drop: ["ALL"] }) && c.securityContext.runAsNonRoot));
rule("containers cannot gain privileges or write to the image", () =>
  everywhere.every((c) => c.securityContext.allowPrivilegeEscalation === false && c.securityContext.readOnlyRootFilesystem === true));
rule("no container is privileged or uses hostPath", () =>
  !JSON.stringify(documents).includes('"privileged":true') && !JSON.stringify(documents).includes('"hostPath"'));
rule("a device is requested by name", () =>
  documents.some((d) => d.patch && JSON.stringify(d.value).includes('"tendon.dev/falcon":"1"')));
rule("a server is only replaced manually", () => server.spec.updateStrategy.type === "OnDelete");
rule("a server cannot be evicted", () => {
  const budget = find_one("PodDisruptionBudget", "server").spec;
  return budget.maxUnavailable === 0 && same(budget.selector.matchLabels, server.spec.template.metadata.labels);
});
rule("a server has a higher priority than batch jobs", () => find_one("PriorityClass", pod.priorityClassName).value >= 1000000);
rule("a server has 30 s to shut down", () => pod.terminationGracePeriodSeconds === 30);
rule("there is no liveness probe", () => !JSON.stringify(documents).includes("livenessProbe"));
rule("the dashboard has a readiness probe", () => one("dash").readinessProbe.httpGet.path === "/metrics");
rule("tendond doctor runs first", () => same(pod.initContainers[0].command.slice(0, 2), ["tendond", "doctor"]));
rule("the keys are a read-only secret", () =>
  pod.volumes.find((v) => v.name === "keys").secret.secretName === "tendon-keys" &&
  everywhere.flatMap((c) => c.volumeMounts ?? []).every((m) => m.name !== "keys" || m.readOnly === true));
rule("the size of the recordings is limited", () => Boolean(pod.volumes.find((v) => v.name === "recordings").emptyDir.sizeLimit));
rule("no pod has access to the API of the cluster", () =>
  [pod, ...engines.map((engine) => engine.spec.template.spec)].every((spec) => spec.automountServiceAccountToken === false));
rule("there are two engines", () => same(engines.map((d) => d.metadata.name).sort(), ["engine", "fem"]));
rule("an engine does not listen on any port", () => everywhere.every((c) => c.ports === undefined));
rule("each engine only runs once at a time", () =>
  engines.every((engine) => engine.spec.replicas === 1 && engine.spec.strategy.type === "Recreate"));
rule("there is one core for each rank and one for the proxy", () => {
  const [fem] = engines.find((d) => d.metadata.name === "fem").spec.template.spec.containers;
  const launch = fem.command[fem.command.indexOf("--launch") + 1];
  return launch === `mpirun -n ${Number(fem.resources.limits.cpu) - 1}` &&
    same(fem.volumeMounts.filter((m) => !m.readOnly).map((m) => m.mountPath), ["/tmp", "/dev/shm"]);
});
// The rules for Agones, which does not use devices.
const fleet = find_one("Fleet", "simulated")?.spec?.template?.spec ?? {};
rule("a simulated server has no device and no capabilities, and uses the network of its node", () =>
  fleet.template.spec.hostNetwork === true && !JSON.stringify(fleet).includes("tendon.dev/") &&
  all_of(fleet.template.spec).every((c) => same(c.securityContext.capabilities, { drop: ["ALL"] }) && c.securityContext.runAsNonRoot &&
    c.securityContext.allowPrivilegeEscalation === false && c.securityContext.readOnlyRootFilesystem === true && c.resources));
rule("a simulated server is not stopped during a session", () => fleet.eviction.safe === "Never" && fleet.health.disabled === true);
rule("a simulated server uses a port of its node", () => same(fleet.ports.map((p) => [p.portPolicy, p.protocol]), [["Passthrough", "UDP"]]));
rule("follow runs tendond and reports its state to Agones", () =>
  fleet.container === "tendond" && fleet.template.spec.containers[0].command[1] === "/follow/follow" &&
  fleet.template.spec.containers[0].command.includes("--json") &&
  fleet.template.spec.volumes.some((v) => v.configMap?.name === "agones-follow"));
rule("every mounted volume exists", () =>
  [pod, ...engines.map((engine) => engine.spec.template.spec), fleet.template.spec].every((spec) =>
    all_of(spec).flatMap((c) => c.volumeMounts ?? []).every((m) => spec.volumes.some((v) => v.name === m.name))));

// ---- Programs and options must exist in this tree -------------------------------------------------------------------

let asked = 0;
if (programs !== "") {
  const helps = new Map();
  const help_of = (command) => {
    const sub = /^[a-z]+$/.test(command[1]) ? [command[1]] : [];
    const key = [command[0], ...sub].join(" ");
    if (!helps.has(key)) helps.set(key, execFileSync(join(programs, command[0]), [...sub, "--help"], { encoding: "utf8" }));
    return helps.get(key);
  };
  const pod_of = (value) => value.spec?.template?.spec?.template?.spec ?? value.spec?.template?.spec;
  const commands = documents.flatMap(({ file, value }) =>
    all_of(pod_of(value)).filter((c) => c.command).map((c) => ({ file, command: c.command.slice(c.command[0] === "bash" ? 2 : 0) })));
  for (const { file, command } of commands) {
    if (!existsSync(join(programs, command[0]))) {
      fault(file, `${command[0]} is not a program of this tree`);
      continue;
    }
    const [program, verb] = command;
    if (/^[a-z]+$/.test(verb) && !new RegExp(`^  ${verb}\\b`, "m").test(help_of([program]))) {
      fault(file, `${program} has no subcommand ${verb}`);
      continue;
    }
    for (const option of command.filter((word) => word.startsWith("--"))) {
      asked += 1;
      if (!help_of(command).includes(option)) fault(file, `${command[0]} has no option ${option}`);
    }
  }
}

for (const line of faults) console.log(line);
console.log(
  `${documents.length} documents of ${kustomizations.length} kustomizations, ${asked} options of programs: ` +
    (faults.length === 0 ? "passed" : `${faults.length} errors`),
);
process.exit(faults.length === 0 ? 0 : 1);
