// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace velatura::fuzz {

/// The interface of the plugin of this build that such a trigger calls for; nullptr where it was
/// not built.
const void* built_interface(const char* interface_name,
                            uint32_t version,
                            const char* trigger_kind,
                            const char* trigger_value);

}  // namespace velatura::fuzz
