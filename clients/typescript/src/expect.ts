// SPDX-License-Identifier: Apache-2.0

/** Throws the RangeError "FIELD = VALUE: expected …" unless `holds`. */
export function expect(holds: boolean, field: string, value: unknown, expected: string): void {
  if (!holds) throw new RangeError(`${field} = ${String(value)}: expected ${expected}`);
}
