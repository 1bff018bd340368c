// SPDX-License-Identifier: Apache-2.0
export { check, type Finding } from "./check.js";
export { writeDataset } from "./dataset.js";
export { readDemonstration, type Moment } from "./demonstration.js";
export { CouplingEpisodes, episodesOfRobot, type Episode, type Frame, type Pose, type Wrench } from "./episodes.js";
export type { Layout } from "./features.js";
export type { Quat, Vec3 } from "./geometry.js";
export type { DatasetConfig } from "./source.js";
export { mapOf, readCoupling, type Act, type CouplingSink, type End, type Port, type PoseMap, type Step } from "./recording.js";
