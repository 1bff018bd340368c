// SPDX-License-Identifier: Apache-2.0
import { spawn, type ChildProcess } from "node:child_process";
import { EventEmitter, once } from "node:events";
import { join } from "node:path";
import { createInterface } from "node:readline";
import type { TestContext } from "node:test";
import { kRoot } from "./paths.js";

const kPatienceMs = 30_000;

/** A running program and the lines of its stdout and stderr. It must be killed at the end of the test. */
export class Program {
  readonly lines: string[] = [];
  readonly #process: ChildProcess;
  readonly #news = new EventEmitter();
  readonly #ended: Promise<number | null>;
  #over = false;

  constructor(test: TestContext, command: string, args: readonly string[]) {
    this.#process = spawn(command, args, { stdio: ["ignore", "pipe", "pipe"] });
    this.#news.setMaxListeners(0);
    this.#ended = new Promise((resolve) =>
      this.#process.once("close", (code) => {
        this.#over = true;
        resolve(code);
        this.#news.emit("line"); // wakes the callers of line(), which then throw
      }),
    );
    for (const stream of [this.#process.stdout!, this.#process.stderr!]) {
      createInterface(stream).on("line", (line) => {
        this.lines.push(line);
        this.#news.emit("line");
      });
    }
    test.after(async () => {
      this.#process.kill("SIGKILL");
      await this.#ended;
    });
  }

  /** Returns the first line that `matches`, including earlier lines. Throws if the program ends or after 30 s. */
  async line(matches: (line: string) => boolean): Promise<string> {
    const signal = AbortSignal.timeout(kPatienceMs);
    const said = () => this.lines.slice(-20).join("\n");
    for (let i = 0; ; ++i) {
      while (i >= this.lines.length) {
        if (this.#over) throw new Error(`ended without the expected line; it said: ${said()}`);
        await once(this.#news, "line", { signal }).catch(() => {
          throw new Error(`has not said the expected line within 30 s; it said: ${said()}`);
        });
      }
      if (matches(this.lines[i]!)) return this.lines[i]!;
    }
  }

  async end(signal?: NodeJS.Signals): Promise<number | null> {
    if (signal) this.#process.kill(signal);
    return this.#ended;
  }
}

/** Returns the path of tendond. Skips the test and returns "" if TENDON_PROGRAMS is not set. */
export function findTendond(test: TestContext): string {
  const programs = process.env["TENDON_PROGRAMS"];
  if (!programs) test.skip("set TENDON_PROGRAMS to the folder that holds tendond");
  return programs ? join(programs, "tendond") : "";
}

export const scene = (name: string): string => join(kRoot, "deploy/scenes", `${name}.toml`);
export const kDemoScene = scene("demo");

/**
 * Starts tendond on a free port with one device per scene. Skips the test and returns undefined without
 * TENDON_PROGRAMS.
 */
export async function startTendond(
  test: TestContext,
  { listen = "127.0.0.1:0", scenes = [kDemoScene] } = {},
): Promise<{ readonly program: Program; readonly address: string } | undefined> {
  const tendond = findTendond(test);
  if (!tendond) return undefined;
  const program = new Program(test, tendond, [...scenes, "--listen", listen, "--record", "/dev/null", "--json"]);
  const said = await program.line((line) => line.includes('"listening"'));
  return { program, address: JSON.parse(said).address };
}

/** Starts a compiled program of the client, such as "examples/virtual_wall". */
export const startNode = (test: TestContext, name: string, ...args: string[]): Program =>
  new Program(test, process.execPath, [join(kRoot, "clients/typescript/dist", `${name}.js`), ...args]);

export async function until(what: string, done: () => boolean): Promise<void> {
  const deadline = performance.now() + kPatienceMs;
  while (!done()) {
    if (performance.now() > deadline) throw new Error(`never came to be: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 5));
  }
}
