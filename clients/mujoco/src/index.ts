// SPDX-License-Identifier: Apache-2.0
export { TouchableScene, type SceneConfig, type SceneStats } from "./touchable_scene.js";
export { Arm } from "./arm.js";
export { Field } from "./field.js";
export { zUp } from "./rotation.js";
export type { Coupling } from "./tool.js";
