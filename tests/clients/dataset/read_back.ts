// SPDX-License-Identifier: Apache-2.0
// Reads a dataset with parquet-wasm (Apache Arrow's Rust implementation), which shares no code with the writer.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

// The packages are installed in clients/dataset, where this runs. TypeScript cannot find their types from here.
const load = createRequire(import.meta.url);
const kReader: string = "parquet-wasm/esm";
const parquet = (await import(kReader)) as {
  initSync: (from: { readonly module: Uint8Array }) => void;
  readParquet: (bytes: Uint8Array) => { intoIPCStream(): Uint8Array };
};
parquet.initSync({ module: readFileSync(load.resolve("parquet-wasm/esm/parquet_wasm_bg.wasm")) });

export interface Column {
  readonly type: string;
  readonly values: readonly (number | readonly number[])[];
}

export function readParquetFile(path: string): Map<string, Column> {
  const { tableFromIPC } = load("apache-arrow") as {
    tableFromIPC: (bytes: Uint8Array) => {
      readonly schema: { readonly fields: readonly { readonly name: string; readonly type: unknown }[] };
      getChild(name: string): Iterable<bigint | number | Iterable<number>>;
    };
  };
  const table = tableFromIPC(parquet.readParquet(new Uint8Array(readFileSync(path))).intoIPCStream());
  const plain = (value: bigint | number | Iterable<number>) =>
    typeof value === "object" ? [...value] : Number(value);
  return new Map(table.schema.fields.map(({ name, type }) => [name, { type: String(type), values: [...table.getChild(name)].map(plain) }]));
}

export const readJson = (path: string): any => JSON.parse(readFileSync(path, "utf8"));
export const readLines = (path: string): any[] => readFileSync(path, "utf8").trimEnd().split("\n").map((line) => JSON.parse(line));
