// SPDX-License-Identifier: Apache-2.0
// Statistics of features, as LeRobot's datasets/compute_stats.py defines them. Its quantiles of an episode are
// estimates from a histogram; ours are exact.

/** Lists with a value for each component; `count` has one value. */
export type Stats = Record<string, number[]>;

const kQuantiles: Readonly<Record<string, number>> = { q01: 0.01, q10: 0.1, q50: 0.5, q90: 0.9, q99: 0.99 };
export const kStatNames = ["min", "max", "mean", "std", "count", ...Object.keys(kQuantiles)];

/** Minimum, maximum, mean, standard deviation of the population and, if wanted, quantiles of each component. */
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
 * Statistics of all episodes, from those of each. As in LeRobot, quantiles are bounds: the lowest up to the median, and
 * the highest above.
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
