// SPDX-License-Identifier: Apache-2.0
// Two readers of Parquet that share no code with the writer, or with each other: parquet-wasm (Apache Arrow, in Rust)
// and DuckDB (C++).
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

export type Cell = number | string | readonly (number | string)[];

export interface Column {
  readonly type: string;
  readonly values: readonly Cell[];
}

type Raw = bigint | number | string | Iterable<Raw>;
const plain = (value: Raw): Cell => (typeof value === "object" ? [...value].map((one) => plain(one) as number | string) : typeof value === "bigint" ? Number(value) : value);

export function readParquetFile(path: string): Map<string, Column> {
  const { tableFromIPC } = load("apache-arrow") as {
    tableFromIPC: (bytes: Uint8Array) => {
      readonly schema: { readonly fields: readonly { readonly name: string; readonly type: unknown }[] };
      getChild(name: string): Iterable<Raw>;
    };
  };
  const table = tableFromIPC(parquet.readParquet(new Uint8Array(readFileSync(path))).intoIPCStream());
  return new Map(table.schema.fields.map(({ name, type }) => [name, { type: String(type), values: [...table.getChild(name)].map(plain) }]));
}

export const readJson = (path: string): any => JSON.parse(readFileSync(path, "utf8"));
export const readLines = (path: string): any[] => readFileSync(path, "utf8").trimEnd().split("\n").map((line) => JSON.parse(line));

export type Query = (sql: string) => Promise<Map<string, Cell>[]>;

/** Undefined if DuckDB has no library for this machine. */
export async function duckdb(): Promise<Query | undefined> {
  interface Result { columnNames(): string[]; getRows(): unknown[][] }
  let module: { DuckDBInstance: { create(): Promise<{ connect(): Promise<{ runAndReadAll(sql: string): Promise<Result> }> }> } };
  try {
    module = load("@duckdb/node-api");
  } catch (error) {
    if (!String(error).includes("node-bindings")) throw error;
    return undefined;
  }
  const connection = await (await module.DuckDBInstance.create()).connect();
  const value = (from: any): Cell => plain(from?.items ?? from);
  return async (sql) => {
    const result = await connection.runAndReadAll(sql);
    return result.getRows().map((row) => new Map(result.columnNames().map((name, i) => [name, value(row[i])])));
  };
}
