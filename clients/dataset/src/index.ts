// SPDX-License-Identifier: Apache-2.0
export { readDemonstration, type Moment } from "./demonstration.js";
export { episodesOf, episodesOfRobot, type Episode, type Frame } from "./episodes.js";
export { writeDataset, type DatasetConfig } from "./lerobot.js";
export { mapOf, readCoupling, type Coupling, type End, type Port, type PoseMap, type Step, type Vec3 } from "./recording.js";
