// SPDX-License-Identifier: Apache-2.0
#pragma once

// This version does not have the functions that are used by tendon-plug.
typedef int dds_entity_t;
