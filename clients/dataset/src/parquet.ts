// SPDX-License-Identifier: Apache-2.0
// Reads and writes tables in Parquet files. Each column contains either numbers or texts, or lists.
import { asyncBufferFromFile, parquetMetadataAsync, parquetReadObjects } from "hyparquet";
import { fileWriter, ParquetWriter } from "hyparquet-writer";
import { mkdirSync } from "node:fs";
import { dirname } from "node:path";

export interface ColumnType {
  readonly type: "FLOAT" | "DOUBLE" | "INT64" | "TEXT";
  readonly list: boolean;
}
export type Columns = ReadonlyMap<string, ColumnType>;

type Value = number | string;
export type Cell = Value | readonly Value[];
type Schema = ConstructorParameters<typeof ParquetWriter>[0]["schema"];

function schemaOf(columns: Columns): Schema {
  const leaf = (name: string, type: ColumnType["type"]): Schema[number] =>
    type === "TEXT" ? { name, repetition_type: "OPTIONAL", type: "BYTE_ARRAY", converted_type: "UTF8" } : { name, repetition_type: "OPTIONAL", type };
  return [{ name: "schema", num_children: columns.size }, ...[...columns].flatMap(([name, { type, list }]) => (list
    ? [
        { name, repetition_type: "OPTIONAL" as const, num_children: 1, converted_type: "LIST" as const },
        { name: "list", repetition_type: "REPEATED" as const, num_children: 1 },
        leaf("element", type),
      ]
    : [leaf(name, type)]))];
}

/** Writes a table in row groups. */
export class TableWriter {
  readonly #columns: Columns;
  readonly #file: ReturnType<typeof fileWriter>;
  readonly #parquet: ParquetWriter;

  constructor(path: string, columns: Columns, metadata: Readonly<Record<string, string>> = {}) {
    mkdirSync(dirname(path), { recursive: true });
    this.#columns = columns;
    this.#file = fileWriter(path);
    const kvMetadata = Object.entries(metadata).map(([key, value]) => ({ key, value }));
    this.#parquet = new ParquetWriter({ writer: this.#file, schema: schemaOf(columns), kvMetadata, createdBy: "tendon-dataset" });
  }

  get bytes(): number {
    return this.#file.offset;
  }

  /** Appends a row group. `cells` must have a list of the same length for each column. */
  append(cells: ReadonlyMap<string, readonly Cell[]>): void {
    const columnData = [...this.#columns].map(([name, { type }]) => {
      const stored = (value: Value): unknown => (type === "INT64" ? BigInt(value) : value);
      const data = cells.get(name)!.map((cell) => (typeof cell === "object" ? cell.map(stored) : stored(cell)));
      return { name, data };
    });
    this.#parquet.write({ columnData, rowGroupSize: columnData[0]!.data.length });
  }

  close(): void {
    this.#parquet.finish();
  }
}

export type Row = Readonly<Record<string, Cell>>;

export interface Table {
  readonly columns: Columns;
  /** Number of rows of each row group. */
  readonly groups: readonly number[];
  readonly metadata: Readonly<Record<string, string>>;
  /** Reads some rows, or all. */
  rows(from?: number, to?: number): Promise<Row[]>;
}

/** Opens a file that consists of such columns. Throws an Error if it is not Parquet. */
export async function openTable(path: string): Promise<Table> {
  const file = await asyncBufferFromFile(path);
  const metadata = await parquetMetadataAsync(file);
  const columns = new Map<string, ColumnType>();
  for (let i = 1; i < metadata.schema.length; ++i) {
    const { name, num_children } = metadata.schema[i]!;
    const list = num_children !== undefined;
    if (list) i += 2;
    const type = metadata.schema[i]?.type;
    columns.set(name, { type: type === "BYTE_ARRAY" ? "TEXT" : (type as ColumnType["type"]), list });
  }
  const plain = (value: unknown): unknown => (Array.isArray(value) ? value.map(plain) : typeof value === "bigint" ? Number(value) : value);
  return {
    columns,
    groups: metadata.row_groups.map(({ num_rows }) => Number(num_rows)),
    metadata: Object.fromEntries((metadata.key_value_metadata ?? []).map(({ key, value }) => [key, value ?? ""])),
    async rows(from = 0, to = Number(metadata.num_rows)) {
      const rows = await parquetReadObjects({ file, metadata, rowStart: from, rowEnd: to });
      return rows.map((row) => Object.fromEntries(Object.entries(row).map(([name, value]) => [name, plain(value) as Cell])));
    },
  };
}
