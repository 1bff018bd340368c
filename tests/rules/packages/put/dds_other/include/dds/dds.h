// SPDX-License-Identifier: Apache-2.0
#pragma once

// This version does not have the functions that tendon-bridge uses.
typedef int dds_entity_t;
