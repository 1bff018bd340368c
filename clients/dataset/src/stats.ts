// SPDX-License-Identifier: Apache-2.0
// Computes the statistics that are defined in LeRobot's datasets/compute_stats.py. LeRobot estimates the quantiles of an
// episode by using a histogram, but here they are exact.

/** Each list contains a value for each component, except that `count` contains a single value. */
export type Stats = Record<string, number[]>;

const kQuantiles: Readonly<Record<string, number>> = { q01: 0.01, q10: 0.1, q50: 0.5, q90: 0.9, q99: 0.99 };
export const kStatNames = ["min", "max", "mean", "std", "count", ...Object.keys(kQuantiles)];

/** Computes the values of each component. The standard deviation is that of the population. */
export function statsOf(rows: readonly (readonly number[])[], { quantiles = true } = {}): Stats {
  const stats: Stats = { min: [], max: [], mean: [], std: [], count: [rows.length] };
  rows[0]!.forEach((_, i) => {
    const values = Float64Array.from(rows, (row) => row[i]!).sort();
    const mean = values.reduce((sum, value) => sum + value, 0) / values.length;
    stats["min"]!.push(values[0]!);
    stats["max"]!.push(values.at(-1)!);
    stats["mean"]!.push(mean);
    stats["std"]!.push(Math.sqrt(values.reduce((sum, value) => sum + (value - mean) ** 2, 0) / values.length));
    if (!quantiles) return;
    for (const [name, q] of Object.entries(kQuantiles)) (stats[name] ??= []).push(quantile(values, q));
  });
  return stats;
}

/** Interpolates linearly between the two nearest of the sorted values. */
function quantile(sorted: Float64Array, q: number): number {
  const at = q * (sorted.length - 1);
  const below = sorted[Math.floor(at)]!;
  return below + (at - Math.floor(at)) * (sorted[Math.ceil(at)]! - below);
}

/**
 * Computes the statistics of all episodes from the statistics of each episode. As in LeRobot, a quantile is the minimum
 * of the episodes if it is at most the median, and the maximum otherwise.
 */
export function aggregate(parts: readonly Stats[]): Stats {
  const counts = parts.map(({ count }) => count![0]!);
  const total = counts.reduce((sum, count) => sum + count, 0);
  const over = (name: string, i: number): number[] => parts.map((part) => part[name]![i]!);
  const each = (of: (i: number) => number): number[] => parts[0]!["mean"]!.map((_, i) => of(i));
  const weighted = (values: readonly number[]): number => values.reduce((sum, value, k) => sum + value * counts[k]!, 0) / total;
  const least = (name: string): number[] => each((i) => over(name, i).reduce((a, b) => Math.min(a, b)));
  const most = (name: string): number[] => each((i) => over(name, i).reduce((a, b) => Math.max(a, b)));
  const mean = each((i) => weighted(over("mean", i)));
  const std = each((i) => Math.sqrt(weighted(parts.map((part) => part["std"]![i]! ** 2 + (part["mean"]![i]! - mean[i]!) ** 2))));
  const quantiles = Object.entries(kQuantiles).map(([name, q]) => [name, q <= 0.5 ? least(name) : most(name)]);
  return { min: least("min"), max: most("max"), mean, std, count: [total], ...Object.fromEntries(quantiles) };
}
