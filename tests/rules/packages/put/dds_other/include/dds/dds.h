// SPDX-License-Identifier: Apache-2.0
#pragma once

// A version without the functions that tendon-bridge uses.
typedef int dds_entity_t;
