// SPDX-License-Identifier: Apache-2.0

/** Refuses an impossible value of a configuration: throws the RangeError "FIELD = VALUE: expected …" unless `holds`. */
export function expect(holds: boolean, field: string, value: unknown, expected: string): void {
  if (!holds) throw new RangeError(`${field} = ${String(value)}: expected ${expected}`);
}
